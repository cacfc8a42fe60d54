// Light that crossed thin parts: what arrives of it below each pixel's centre, times the share that leaves towards the eye.
//#include "bilinear.wgsl"
//#include "surface_hit.wgsl"
//#include "planes.wgsl"

override TRANSLUCENT_FIRST: u32 = UNASKED;

@group(0) @binding(53) var through: texture_2d<f32>; // on the atlas

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let cell = cell_of(id.xy, size);
    let point = seen_at(id.xy, size).point;
    let light = select(vec3f(0.0), load_bilinear(through, point.place).rgb, (point.flags & MAPPED) != 0u);
    put_vec3f(TRANSLUCENT_FIRST, cell, get_vec3f(TRANSLUCENT_FIRST, cell) * light);
}
