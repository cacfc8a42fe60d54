// Weighted sum of the blurred levels of one resolution, reduced by the light that thin parts do not return, plus the sum of
// the coarser levels and the light through thin parts.
//#include "source.wgsl"
//#include "store.wgsl"
//#include "bilinear.wgsl"

override COARSER: bool = false; // whether there are coarser levels
override TRANSMITTED: bool = false; // whether transmitted light is added
override THIN: bool = false; // whether thin parts return less light

struct Weights {
    first: u32, // first layer
    count: u32,
    scale: f32, // factor from the levels to the stored sum
    transmitted_scale: f32, // factor of the transmitted light
    weight: array<vec4f, 24>,
}

@group(0) @binding(0) var<uniform> weights: Weights;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var transmitted: texture_2d<f32>; // light, and 1 where there is surface; may have a coarser resolution
@group(0) @binding(6) var lost: texture_2d<f32>; // fraction that thin parts do not return, and 1 where there is surface
// source: sum of the coarser levels, and 1 where there is surface

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(levels);
    if (any(id.xy >= size)) {
        return;
    }
    var sum = vec4f(0.0);
    var k = 0u;
    loop { // with the test at the end, as in lighting.wgsl
        sum += weights.weight[k] * textureLoad(levels, id.xy, weights.first + k, 0);
        k++;
        if (k >= weights.count) {
            break;
        }
    }
    let uv = (vec2f(id.xy) + 0.5) / vec2f(size);
    var loss = vec3f(0.0);
    if (THIN) {
        let sampled = load_bilinear(lost, uv);
        loss = sampled.rgb / max(sampled.a, 1e-6);
        sum = vec4f(sum.rgb * (1.0 - min(loss, vec3f(1.0))), sum.a);
    }
    if (COARSER) {
        let light = source_at(uv);
        sum += vec4f(light.rgb / max(light.a, 1e-6), 0.0);
    }
    sum = vec4f(weights.scale * sum.rgb, sum.a);
    if (TRANSMITTED) {
        let light = load_bilinear(transmitted, uv);
        // Where a point has several thin parts, the sum of their losses may exceed 1.
        sum += vec4f(weights.transmitted_scale * light.rgb / (max(light.a, 1e-6) * max(loss, vec3f(1.0))), 0.0);
    }
    store(id.xy, sum);
}
