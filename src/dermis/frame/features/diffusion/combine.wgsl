// The weighted sum of the blurred levels of one resolution, less what thin parts let pass, the sum of the coarser ones, and that light.
//#include "source.wgsl"
//#include "store.wgsl"
//#include "bilinear.wgsl"

override COARSER: bool = false; // whether there are levels of less resolution
override TRANSMITTED: bool = false; // whether light comes through thin parts
override THIN: bool = false; // whether thin parts return less

struct Weights {
    first: u32, // first layer
    count: u32,
    scale: f32, // factor from the layers to what is stored
    through: f32, // factor of the transmitted light
    weight: array<vec4f, 24>,
}

@group(0) @binding(0) var<uniform> weights: Weights;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var transmitted: texture_2d<f32>; // light, and 1 where there is surface; maybe at less resolution
@group(0) @binding(6) var lost: texture_2d<f32>; // share that thin parts do not return, and 1 where there is surface
// source: the sum of the coarser levels, and 1 where there is surface

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(levels);
    if (any(id.xy >= size)) {
        return;
    }
    var sum = vec4f(0.0);
    var k = 0u;
    loop { // with its test at the end, as in lighting.wgsl
        sum += weights.weight[k] * textureLoad(levels, id.xy, weights.first + k, 0);
        k++;
        if (k >= weights.count) {
            break;
        }
    }
    let place = (vec2f(id.xy) + 0.5) / vec2f(size);
    var gone = vec3f(0.0);
    if (THIN) {
        let share = load_bilinear(lost, place);
        gone = share.rgb / max(share.a, 1e-6);
        sum = vec4f(sum.rgb * (1.0 - min(gone, vec3f(1.0))), sum.a);
    }
    if (COARSER) {
        let light = source_at(place);
        sum += vec4f(light.rgb / max(light.a, 1e-6), 0.0);
    }
    sum = vec4f(weights.scale * sum.rgb, sum.a);
    if (TRANSMITTED) {
        let light = load_bilinear(transmitted, place);
        // Between several sheets more may seem to pass than there is.
        sum += vec4f(weights.through * light.rgb / (max(light.a, 1e-6) * max(gone, vec3f(1.0))), 0.0);
    }
    store(id.xy, sum);
}
