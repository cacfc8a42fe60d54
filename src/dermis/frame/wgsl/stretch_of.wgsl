// How the map lies on the surface: texels per mm along u and v, and the cosine of the angle between the two.
//#include "geometry.wgsl"
//#include "halves.wgsl"

override SHEAR: bool = true; // whether the angle counts
override EVEN: f32 = 0.0; // one density for all [texels/mm]; 0 for that of each place
override FEATHER_MM: f32 = 0.0; // width over which blurs narrow towards the edges of charts; 0 for none

//#fill const MOST_SHEAR: f32 = {most_shear}; // a map that is sheared more is blurred as if by this much
const MOST_PER_MM: f32 = 6e4;
const LEAST_SHARE: f32 = 1e-3; // of the blur at the edge itself: 0 would mean no surface

@group(0) @binding(30) var stretch_map: texture_storage_2d<rgba16float, write>;

struct Lengths {
    u: f32, // [mm per unit of uv]
    v: f32,
    cosine: f32,
}

fn lengths_at(index: u32) -> Lengths {
    let corner = corner_at(index);
    let u = length(corner.dpdu);
    let v = length(corner.dpdv);
    return Lengths(u, v, dot(corner.dpdu, corner.dpdv) / max(u * v, 1e-12));
}

// Of a place in a triangle, by its barycentric weights.
fn stretch_of(triangle: u32, w: vec3f) -> vec3f {
    let t = triangle_at(triangle);
    let a = lengths_at(t.x);
    let b = lengths_at(t.y);
    let c = lengths_at(t.z);
    let lengths = w.x * vec3f(a.u, a.v, a.cosine) + w.y * vec3f(b.u, b.v, b.cosine) + w.z * vec3f(c.u, c.v, c.cosine);
    let per_mm = min(texels_per_uv(triangle) / max(lengths.xy, vec2f(1e-3)), vec2f(MOST_PER_MM));
    let density = select(per_mm, vec2f(EVEN), EVEN > 0.0);
    return vec3f(density, select(0.0, clamp(lengths.z, -MOST_SHEAR, MOST_SHEAR), SHEAR));
}

fn put_stretch(at: vec2u, stretch: vec3f) {
    textureStore(stretch_map, at, rounded_to_halves(vec4f(stretch, 0.0)));
}
