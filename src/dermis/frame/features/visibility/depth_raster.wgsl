// Rasterises the nearest depth of triangles whose corners are given by an index buffer, so that each vertex is moved only once.
//#include "shape/mesh_textures.wgsl"
//#include "views.wgsl"

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) layer: u32) -> @builtin(position) vec4f {
    return views.clip[layer] * vec4f(textureLoad(vertex_table, vertex_texel(index), 0).xyz, 1.0);
}
