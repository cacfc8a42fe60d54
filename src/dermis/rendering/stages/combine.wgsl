// The weighted sum of the blurred levels, and what comes through thin parts: all the light that left the skin.
//#include "bilinear.wgsl"

override TRANSMITTED: bool = false; // whether something comes through

struct Weights {
    first: u32,
    count: u32,
    weight: array<vec4f, 24>,
}

@group(0) @binding(0) var<uniform> weights: Weights;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var transmitted: texture_2d<f32>; // light, and 1 where there is surface; maybe fewer texels
@group(0) @binding(3) var combined: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(levels))) {
        return;
    }
    var sum = vec4f(0.0);
    for (var k = 0u; k < weights.count; k++) {
        sum += weights.weight[k] * textureLoad(levels, id.xy, weights.first + k, 0);
    }
    if (TRANSMITTED) {
        let light = load_bilinear(transmitted, (vec2f(id.xy) + 0.5) / vec2f(textureDimensions(levels)));
        sum += vec4f(light.rgb / max(light.a, 1e-6), 0.0);
    }
    textureStore(combined, id.xy, sum);
}
