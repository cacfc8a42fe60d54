// Adds light that was diffused over the picture to the output of diffuse light.
//#include "output_images.wgsl"

override DIFFUSE_FIRST: u32 = NOT_REQUESTED;

@group(0) @binding(0) var below: texture_2d<f32>; // diffused light below the skin
@group(0) @binding(1) var leaving: texture_2d<f32>; // fraction of that light that leaves towards the eye

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(below);
    if (any(id.xy >= size)) {
        return;
    }
    let slot = pixel_slot(id.xy, size);
    let light = textureLoad(below, id.xy, 0).rgb * textureLoad(leaving, id.xy, 0).rgb;
    write_vec3f(DIFFUSE_FIRST, slot, read_vec3f(DIFFUSE_FIRST, slot) + light);
}
