// Stretch of the atlas: texels per mm along u and v, and the cosine of the angle between u and v on the surface.
//#include "shape/geometry.wgsl"
//#include "halves.wgsl"

override SHEAR: bool = true; // whether the angle is taken into account
override EVEN: f32 = 0.0; // constant density [texels/mm]; 0 for the local one
override FEATHER_MM: f32 = 0.0; // width over which blurs narrow towards the edges of charts; 0 for none

//#fill const MAX_SHEAR: f32 = {max_shear}; // limit of the cosine
const MAX_PER_MM: f32 = 6e4;
const MIN_FRACTION: f32 = 1e-3; // factor of the density at the very edge of a chart; 0 would mark an empty texel

@group(0) @binding(25) var<storage, read> vertex_lengths: array<vec4f>; // of dpdu and dpdv, the cosine between them
@group(0) @binding(30) var stretch_map: texture_storage_2d<rgba16float, write>;

// w : barycentric weights
fn stretch_at(triangle: u32, w: vec3f) -> vec3f {
    let t = triangle_at(triangle);
    let lengths = (w.x * vertex_lengths[t.x] + w.y * vertex_lengths[t.y] + w.z * vertex_lengths[t.z]).xyz;
    let per_mm = min(texels_per_uv(triangle) / max(lengths.xy, vec2f(1e-3)), vec2f(MAX_PER_MM));
    let density = select(per_mm, vec2f(EVEN), EVEN > 0.0);
    return vec3f(density, select(0.0, clamp(lengths.z, -MAX_SHEAR, MAX_SHEAR), SHEAR));
}

fn store_stretch(at: vec2u, stretch: vec3f) {
    textureStore(stretch_map, at, rounded_to_halves(vec4f(stretch, 0.0)));
}
