// Entry point of stages that read the mesh at the centres of pixels; the including shader defines write_outputs.
//#include "surface_hit.wgsl"
//#include "output_images.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let hit = hit_at(id.xy, size);
    let found_hit = is_hit(id.xy);
    let slot = pixel_slot(id.xy, size);
    write_outputs(hit, found_hit, slot);
}
