// Multiplies the translucent output by the light through thin parts; until then, the output holds the fraction that leaves
// towards the eye.
//#include "bilinear.wgsl"
//#include "surface_hit.wgsl"
//#include "output_images.wgsl"

override TRANSLUCENT_FIRST: u32 = NOT_REQUESTED;

@group(0) @binding(53) var transmitted: texture_2d<f32>; // light over the atlas

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let slot = pixel_slot(id.xy, size);
    let point = hit_at(id.xy, size).point;
    let light = select(vec3f(0.0), load_bilinear(transmitted, point.atlas_uv).rgb, (point.flags & MAPPED) != 0u);
    write_vec3f(TRANSLUCENT_FIRST, slot, read_vec3f(TRANSLUCENT_FIRST, slot) * light);
}
