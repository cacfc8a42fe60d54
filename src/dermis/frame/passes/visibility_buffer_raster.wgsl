// The rasteriser's way to the nearest surface: depth, and the triangle where a colour target asks for it.
//#include "mesh_textures.wgsl"
//#include "views.wgsl"

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) layer: u32) -> Seen {
    let corner = textureLoad(vertex_table, vertex_texel(triangle_texel(index / 3u, 0u)[index % 3u]), 0).xyz;
    return Seen(views.clip[layer] * vec4f(corner, 1.0), index / 3u);
}

@fragment
fn fragment(seen: Seen) -> @location(0) u32 {
    return seen.triangle + 1u;
}
