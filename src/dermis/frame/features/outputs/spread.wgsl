// Light that spread over the picture, added to what leaves without spreading.
//#include "planes.wgsl"

override DIFFUSE_FIRST: u32 = UNASKED;

@group(0) @binding(0) var below: texture_2d<f32>; // light below the skin, spread
@group(0) @binding(1) var leaving: texture_2d<f32>; // share of it that leaves towards the eye

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(below);
    if (any(id.xy >= size)) {
        return;
    }
    let cell = cell_of(id.xy, size);
    let light = textureLoad(below, id.xy, 0).rgb * textureLoad(leaving, id.xy, 0).rgb;
    put_vec3f(DIFFUSE_FIRST, cell, get_vec3f(DIFFUSE_FIRST, cell) + light);
}
