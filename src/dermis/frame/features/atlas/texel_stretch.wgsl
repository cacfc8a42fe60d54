// How the map lies on the surface: texels per mm along u and v, and the cosine of the angle between the two.
//#include "shape/geometry.wgsl"
//#include "halves.wgsl"

override SHEAR: bool = true; // whether the angle counts
override EVEN: f32 = 0.0; // one density for all [texels/mm]; 0 for that of each place
override FEATHER_MM: f32 = 0.0; // width over which blurs narrow towards the edges of charts; 0 for none

//#fill const MOST_SHEAR: f32 = {most_shear}; // a map that is sheared more is blurred as if by this much
const MOST_PER_MM: f32 = 6e4;
const LEAST_SHARE: f32 = 1e-3; // of the blur at the edge itself: 0 would mean no surface

@group(0) @binding(25) var<storage, read> vertex_lengths: array<vec4f>; // of dpdu and dpdv, the cosine between them
@group(0) @binding(30) var stretch_map: texture_storage_2d<rgba16float, write>;

// Of a place in a triangle, by its barycentric weights.
fn stretch_of(triangle: u32, w: vec3f) -> vec3f {
    let t = triangle_at(triangle);
    let lengths = (w.x * vertex_lengths[t.x] + w.y * vertex_lengths[t.y] + w.z * vertex_lengths[t.z]).xyz;
    let per_mm = min(texels_per_uv(triangle) / max(lengths.xy, vec2f(1e-3)), vec2f(MOST_PER_MM));
    let density = select(per_mm, vec2f(EVEN), EVEN > 0.0);
    return vec3f(density, select(0.0, clamp(lengths.z, -MOST_SHEAR, MOST_SHEAR), SHEAR));
}

fn put_stretch(at: vec2u, stretch: vec3f) {
    textureStore(stretch_map, at, rounded_to_halves(vec4f(stretch, 0.0)));
}
