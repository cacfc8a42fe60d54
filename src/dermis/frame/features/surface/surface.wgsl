// The skin's numbers, and the tables of its surface.
//#include "bilinear.wgsl"

const PI: f32 = 3.14159265358979;

// Members named as a field or property of scene/skin.py hold it; frame/features/surface/record.py derives the others.
struct Skin {
    m: f32, // Beckmann roughness with the skin's oil where the roughness map is 1
    strength: f32, // rho_s with the skin's oil where the specular map is 1
    f0: f32, // Schlick's reflectance at normal incidence
    eta: f32, // index of refraction
    loss: f32, // factor of the surface's albedo in what enters and leaves: 0 for no term, 1, or the published pi
    returned: f32, // 1 when light that the surface reflects back inside comes out after all, else 0
    tint: f32, // 1 colours the reflection by the colour map, which is wrong for skin
    mix: f32, // share of the colour map applied before scattering
    relief_band: f32, // mip of the height map from which on the normal map has the relief, -1 for none
    light_count: u32,
    inner_eta: f32, // index of half-spaces, 1 for those without a surface; see direction.wgsl
    mean_once: f32, // of 1/(a + b) over both directions
    aside_mm: f32, // how far beside where it entered the middle of light comes back that came along the surface
    once: vec3f, // strength of single scattering
    back_from_everywhere: vec3f, // share of uniform light that comes back, over that of light from straight above
    back: array<vec4f, 32>, // the same for light from one direction, by evenly spaced roots of its cosine
    across: array<vec4f, 32>, // of light from one direction, what passes deep slabs, over that of uniform light that comes back alike
}

@group(0) @binding(2) var<uniform> skin: Skin;
@group(0) @binding(13) var nearest_sampler: sampler; // non-filtering, to gather with
@group(0) @binding(9) var beckmann_table: texture_2d<f32>;
@group(0) @binding(10) var albedo_table: texture_2d<f32>; // rho_dt and its mean over directions

// Bilinear weights of the four texels in the order in which they are gathered; whole numbers are texel centres.
fn gather_weights(place: vec2f) -> vec4f {
    return bilinear_weights(place).zwyx;
}
