// Places that give light and places that take it through the flesh, and how they lie to each other.
//#include "translucent_source.wgsl"

struct Receiver {
    position: vec3f,
    texel: u32, // of the atlas, x and y packed
    normal: vec3f,
    metric: vec3f, // squares of a texel along u and v, and the product of both [mm^2]
}

const NOWHERE: u32 = 0x80008000u; // offset in the map to what no blur reaches

const ASKEW: f32 = 0.5; // cosine of two normals from which a place counts
const OPPOSED: f32 = -0.2; // to which it counts more and more
const ACROSS_AIR: f32 = -0.5; // mean cosine to the inward normals at which two places only see each other from outside

struct Lie {
    cosine: f32, // of the normals
    inward: f32, // mean cosine of the way to the inward normals
    square: f32, // of the distance [mm^2]
    depth: f32, // under the tangent plane of the place that gives [mm]
}

fn lie_of(place: vec3f, normal: vec3f, source: Source) -> Lie {
    let to = source.centre - place;
    let square = dot(to, to);
    let depth = dot(to, source.normal);
    let inward = 0.5 * (depth - dot(to, normal)) * inverseSqrt(max(square, 1e-12));
    return Lie(dot(normal, source.normal), inward, square, abs(depth));
}

// From 0 at the start to 1 at the end, smooth at both.
fn rise(start: f32, end: f32, x: f32) -> f32 {
    let t = saturate((x - start) / (end - start));
    return t * t * (3.0 - 2.0 * t);
}

fn share_of(cosine: f32, inward: f32) -> f32 {
    return rise(ASKEW, OPPOSED, cosine) * rise(ACROSS_AIR, 0.0, inward);
}
