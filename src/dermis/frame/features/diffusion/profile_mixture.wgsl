// Exitance of skin with blended profiles: the mean of two blends, with the weights at the exit point and at the entry point.
//#include "packed_blend_weights.wgsl"

override OTHERS: u32; // profiles besides the first

@group(0) @binding(0) var sums: texture_2d_array<f32>; // exitance by the first profile; for each other profile, its difference for all light and for light times its weight
@group(0) @binding(1) var blend_weights: texture_2d<f32>; // see profile_blend_weights.wgsl
@group(0) @binding(2) var mixed: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(mixed))) {
        return;
    }
    let weights = textureLoad(blend_weights, id.xy, 0).xy;
    var light = textureLoad(sums, id.xy, 0, 0).rgb;
    for (var k = 0u; k < OTHERS; k++) {
        let by_exit = weights[k] * textureLoad(sums, id.xy, 1u + 2u * k, 0).rgb;
        light += 0.5 * (by_exit + textureLoad(sums, id.xy, 2u + 2u * k, 0).rgb);
    }
    textureStore(mixed, id.xy, vec4f(light, packed_weights(weights)));
}
