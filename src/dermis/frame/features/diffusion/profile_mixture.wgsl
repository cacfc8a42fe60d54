// The light that leaves skin of mixed profiles: half by what the skin is where light leaves, half by what it is where it enters.
//#include "packed_blend_weights.wgsl"

override OTHERS: u32; // profiles besides the first

@group(0) @binding(0) var sums: texture_2d_array<f32>; // of the first profile; for each other, how it differs, both ways
@group(0) @binding(1) var shares: texture_2d<f32>; // as profile_blend_weights.wgsl stores them
@group(0) @binding(2) var mixed: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(mixed))) {
        return;
    }
    let share = textureLoad(shares, id.xy, 0).xy;
    var light = textureLoad(sums, id.xy, 0, 0).rgb;
    for (var k = 0u; k < OTHERS; k++) {
        let where_it_leaves = share[k] * textureLoad(sums, id.xy, 1u + 2u * k, 0).rgb;
        light += 0.5 * (where_it_leaves + textureLoad(sums, id.xy, 2u + 2u * k, 0).rgb);
    }
    textureStore(mixed, id.xy, vec4f(light, packed_shares(share)));
}
