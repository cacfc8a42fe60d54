// Display colours of the layers of the atlas: light, stretch and thickness.
//#include "srgb.wgsl"

const LEVEL_VIEW: u32 = 0u;
const STRETCH_VIEW: u32 = 1u;
const THICKNESS_VIEW: u32 = 2u;

const THIN_MM: f32 = 6.0; // thickness at which the brightness is 1/e

// Red: texels per mm along u relative to the mean; green: along v; blue: shear of the two directions.
fn stretch_colour(metric: vec4f, mean: f32) -> vec3f {
    if (metric.x <= 0.0) {
        return vec3f(0.0);
    }
    return vec3f(0.5 + 0.25 * log2(metric.xy / mean), 0.5 + 0.5 * metric.z);
}

// scale : factor from light to display values; for stretch, mean number of texels per mm
fn layer_colour(quantity: u32, value: vec4f, scale: f32) -> vec3f {
    // Without branches, because the software driver Mesa 22.3 leaks memory at each dispatch of branching code.
    let light = encode_srgb(scale * value.rgb / 3.14159265);
    let thickness = vec3f(exp(-value.x / THIN_MM));
    let other = select(thickness, stretch_colour(value, scale), quantity == STRETCH_VIEW);
    return select(other, light, quantity == LEVEL_VIEW);
}
