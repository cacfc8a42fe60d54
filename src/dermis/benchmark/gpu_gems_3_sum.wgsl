// The weighted sum of the blurred levels and of what comes through thin parts, as fragments of a render pass.
//#include "covering.wgsl"
//#include "bilinear.wgsl"

struct Weights {
    count: u32,
    through: f32, // 1 where something comes through, else 0
    weight: array<vec4f, 24>,
}

@group(0) @binding(0) var<uniform> weights: Weights;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var transmitted: texture_2d<f32>; // light, and 1 where there is surface; maybe fewer texels

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var sum = vec4f(0.0);
    for (var k = 0u; k < weights.count; k++) {
        sum += weights.weight[k] * textureLoad(levels, vec2u(at.xy), 1u + k, 0);
    }
    if (weights.through > 0.0) {
        let light = load_bilinear(transmitted, at.xy / vec2f(textureDimensions(levels)));
        sum += vec4f(light.rgb / max(light.a, 1e-6), 0.0);
    }
    return sum;
}
