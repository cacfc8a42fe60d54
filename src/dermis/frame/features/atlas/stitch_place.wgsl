// Writes the gathered light to the gutter texels.
//#include "gutter.wgsl"
//#include "store.wgsl"

@group(0) @binding(1) var<storage, read> gathered: array<vec4f>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (index < arrayLength(&gutter)) {
        store(gutter[index].texel, gathered[index]);
    }
}
