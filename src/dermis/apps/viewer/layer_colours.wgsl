// Colours of what a layer of the atlas holds: light, stretch, thickness.
//#include "srgb.wgsl"

const LEVEL_VIEW: u32 = 0u;
const STRETCH_VIEW: u32 = 1u;
const THICKNESS_VIEW: u32 = 2u;

const THIN_MM: f32 = 6.0; // thickness at which a third of the brightness is left

// More texels than the mean along u are red, along v green; where the two are sheared blue leaves the middle.
fn stretch_colour(metric: vec4f, mean: f32) -> vec3f {
    if (metric.x <= 0.0) {
        return vec3f(0.0);
    }
    return vec3f(0.5 + 0.25 * log2(metric.xy / mean), 0.5 + 0.5 * metric.z);
}

// scale : of light to the display, or the mean texels per mm
fn layer_colour(what: u32, value: vec4f, scale: f32) -> vec3f {
    // No branches: with them the software driver (Mesa 22.3) loses memory at each dispatch.
    let light = encode_srgb(scale * value.rgb / 3.14159265);
    let thickness = vec3f(exp(-value.x / THIN_MM));
    let other = select(thickness, stretch_colour(value, scale), what == STRETCH_VIEW);
    return select(other, light, what == LEVEL_VIEW);
}
