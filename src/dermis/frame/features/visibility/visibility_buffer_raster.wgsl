// Rasterises the nearest surface: its depth and its triangle.
//#include "shape/mesh_textures.wgsl"
//#include "views.wgsl"

struct Rasterised {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) layer: u32) -> Rasterised {
    let corner = textureLoad(vertex_table, vertex_texel(triangle_texel(index / 3u, 0u)[index % 3u]), 0).xyz;
    return Rasterised(views.clip[layer] * vec4f(corner, 1.0), index / 3u);
}

@fragment
fn fragment(pixel: Rasterised) -> @location(0) u32 {
    return pixel.triangle + 1u;
}
