// Weighted sum of the blurred levels, less the light lost in thin parts, plus light through thin parts, as a fragment shader.
//#include "full_screen_triangle.wgsl"
//#include "bilinear.wgsl"

struct Weights {
    count: u32,
    through: f32, // 1 with light through thin parts, else 0
    weight: array<vec4f, 24>,
}

@group(0) @binding(0) var<uniform> weights: Weights;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var transmitted: texture_2d<f32>; // light, and 1 on the surface; may have fewer texels
@group(0) @binding(6) var lost: texture_2d<f32>; // fraction lost in thin parts, in the same format

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    var sum = vec4f(0.0);
    for (var k = 0u; k < weights.count; k++) {
        sum += weights.weight[k] * textureLoad(levels, vec2u(position.xy), 1u + k, 0);
    }
    if (weights.through > 0.0) {
        let uv = position.xy / vec2f(textureDimensions(levels));
        let light = load_bilinear(transmitted, uv);
        let lost_fraction = load_bilinear(lost, uv);
        let fraction = lost_fraction.rgb / max(lost_fraction.a, 1e-6);
        let through = light.rgb / (max(light.a, 1e-6) * max(fraction, vec3f(1.0)));
        sum = vec4f(sum.rgb * (1.0 - min(fraction, vec3f(1.0))) + through, sum.a);
    }
    return sum;
}
