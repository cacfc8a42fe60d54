// Sources, where light enters a thin part; receivers, where it leaves; and the geometry of a pair of source and receiver.
//#include "translucent_source.wgsl"

struct Receiver {
    position: vec3f,
    texel: u32, // of the atlas, x and y packed
    normal: vec3f,
    metric: vec3f, // first fundamental form per texel: E, G and F [mm^2]
}

const NO_OFFSET: u32 = 0x80008000u; // offset in the atlas to a source that no blur reaches

const MAX_COSINE: f32 = 0.5; // cosine between the normals above which a pair has no weight
const FULL_COSINE: f32 = -0.2; // cosine below which it has its full weight
const MIN_INWARD: f32 = -0.5; // mean cosine to the inward normals at which the segment of a pair lies outside the head

struct PairGeometry {
    cosine: f32, // between the normals
    inward: f32, // mean cosine between the segment and the inward normals
    distance2: f32, // squared distance [mm^2]
    depth: f32, // of the receiver below the tangent plane of the source [mm]
}

fn pair_geometry(position: vec3f, normal: vec3f, source: Source) -> PairGeometry {
    let to = source.centre - position;
    let distance2 = dot(to, to);
    let depth = dot(to, source.normal);
    let inward = 0.5 * (depth - dot(to, normal)) * inverseSqrt(max(distance2, 1e-12));
    return PairGeometry(dot(normal, source.normal), inward, distance2, abs(depth));
}

// Smooth step from 0 at `start` to 1 at `end`; start may exceed end.
fn smooth_ramp(start: f32, end: f32, x: f32) -> f32 {
    let t = saturate((x - start) / (end - start));
    return t * t * (3.0 - 2.0 * t);
}

// Weight of a pair by its orientation, 0 to 1.
fn pair_fraction(cosine: f32, inward: f32) -> f32 {
    return smooth_ramp(MAX_COSINE, FULL_COSINE, cosine) * smooth_ramp(MIN_INWARD, 0.0, inward);
}
