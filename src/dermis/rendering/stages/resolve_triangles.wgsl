// Triangles from the buffer where they were found into the layers of a texture; the buffers are left empty for next time.
//#include "views.wgsl"

@group(1) @binding(1) var<storage, read_write> nearness: array<u32>;
@group(1) @binding(2) var<storage, read_write> found: array<u32>;
@group(1) @binding(3) var layers: texture_storage_2d_array<r32uint, write>;

@compute @workgroup_size(32, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= views.width || id.y >= views.height) {
        return;
    }
    let at = (id.z * views.height + id.y) * views.width + id.x;
    textureStore(layers, id.xy, id.z, vec4u(found[at]));
    nearness[at] = 0u;
    found[at] = 0u;
}
