// The entry of stages that read the mesh at pixel centres: what they put there is their own function put_seen.
//#include "surface_hit.wgsl"
//#include "planes.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let seen = seen_at(id.xy, size);
    let there = sees_any(id.xy);
    let cell = cell_of(id.xy, size);
    put_seen(seen, there, cell);
}
