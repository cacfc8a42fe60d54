// Rasterises depth with an index buffer, so that each vertex is transformed only once.
//#include "shape/mesh_textures.wgsl"
//#include "views.wgsl"

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) layer: u32) -> @builtin(position) vec4f {
    return views.clip[layer] * vec4f(textureLoad(vertex_table, vertex_texel(index), 0).xyz, 1.0);
}
