// Parameters of the skin's surface, and tables that describe its reflection.
//#include "bilinear.wgsl"

const PI: f32 = 3.14159265358979;

// Members with the name of a field or property of scene/skin.py have its value; frame/features/surface/record.py derives the others.
struct Skin {
    m: f32, // Beckmann roughness, oil included, where the roughness map is 1
    specular_strength: f32, // rho_s, oil included, where the specular map is 1
    f0: f32, // Schlick's reflectance at normal incidence
    eta: f32, // index of refraction
    loss: f32, // factor of the specular albedo by which transmission is reduced: 0 for none, 1, or the published pi
    returned: f32, // 1 if light that the surface reflects back inside leaves in the end, else 0
    tint: f32, // 1 multiplies the reflection by the colour map, which is wrong for skin
    mix: f32, // exponent of the colour map that is applied before scattering
    relief_band: f32, // mip level of the height map that has the size of the normal map, -1 without both; see record.py
    light_count: u32,
    eta_below: f32, // index of refraction of the half-space, 1 without a surface; see direction.wgsl
    mean_single_scattering: f32, // mean of 1/(a + b) over both directions
    lobes: vec3f, // squared roughnesses of the narrow and the wide lobe relative to m, and weight of the narrow one
    oblique_offset_mm: f32, // lateral offset of the mean exit point for grazing incidence [mm]
    single_scattering: vec3f, // strength of single scattering
    uniform_reflectance: vec3f, // reflectance of uniform light relative to that at normal incidence
    reflectance: array<vec4f, 32>, // reflectance of light from one direction relative to that at normal incidence, at evenly spaced roots of the cosine
    bands: array<vec4f, 3>, // matrix from RGB colours to the channels of the picture, by rows
    vellus_per_mm: f32, // extinction of the layer of vellus hair [1/mm]
    transmittance: array<vec4f, 32>, // light from one direction that passes deep slabs, relative to that of uniform light with equal reflectance
}

@group(0) @binding(2) var<uniform> skin: Skin;
@group(0) @binding(13) var nearest_sampler: sampler; // non-filtering
@group(0) @binding(9) var beckmann_table: texture_2d<f32>;
@group(0) @binding(10) var albedo_table: texture_2d<f32>; // rho_dt and its mean over directions

override BANDS: bool = false; // whether wavelengths take the place of red, green and blue

//#if BANDS
// Reflectance of an RGB colour at the three wavelengths of the channels.
fn in_channels(rgb: vec3f) -> vec3f {
    return vec3f(dot(skin.bands[0].xyz, rgb), dot(skin.bands[1].xyz, rgb), dot(skin.bands[2].xyz, rgb));
}
//#end

// Roughness m of a surface whose slopes have an additional variance [OlanoBaker2010]. Both lobes of a model with two widen by
// the same variance; the roughness is that with the same peak of their mixed slope distributions.
fn widened(m: f32, variance: f32) -> f32 {
    let weights = vec2f(skin.lobes.z, 1.0 - skin.lobes.z);
    return sqrt(dot(weights, 1.0 / skin.lobes.xy) / dot(weights, 1.0 / (m * m * skin.lobes.xy + variance)));
}

// Bilinear weights of four texels in the order of textureGather; integers are texel centres.
fn gather_weights(position: vec2f) -> vec4f {
    return bilinear_weights(position).zwyx;
}
