// The weighted sum of the blurred levels, less what thin parts do not return, and of what comes through thin parts, as fragments of a render pass.
//#include "full_screen_triangle.wgsl"
//#include "bilinear.wgsl"

struct Weights {
    count: u32,
    through: f32, // 1 where something comes through, else 0
    weight: array<vec4f, 24>,
}

@group(0) @binding(0) var<uniform> weights: Weights;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var transmitted: texture_2d<f32>; // light, and 1 where there is surface; maybe fewer texels
@group(0) @binding(6) var lost: texture_2d<f32>; // share that thin parts do not return, alike

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var sum = vec4f(0.0);
    for (var k = 0u; k < weights.count; k++) {
        sum += weights.weight[k] * textureLoad(levels, vec2u(at.xy), 1u + k, 0);
    }
    if (weights.through > 0.0) {
        let place = at.xy / vec2f(textureDimensions(levels));
        let light = load_bilinear(transmitted, place);
        let share = load_bilinear(lost, place);
        let gone = share.rgb / max(share.a, 1e-6);
        let through = light.rgb / (max(light.a, 1e-6) * max(gone, vec3f(1.0)));
        sum = vec4f(sum.rgb * (1.0 - min(gone, vec3f(1.0))) + through, sum.a);
    }
    return sum;
}
