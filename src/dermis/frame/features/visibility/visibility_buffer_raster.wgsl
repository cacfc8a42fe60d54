// Rasterises the nearest surface in each pixel: its depth and its triangle.
//#include "shape/mesh_textures.wgsl"
//#include "views.wgsl"
//#include "cutouts.wgsl"

struct Rasterised {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) uv: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) layer: u32) -> Rasterised {
    let texel = vertex_texel(triangle_texel(index / 3u, 0u)[index % 3u]);
    let corner = textureLoad(vertex_table, texel, 0);
    let uv = vec2f(corner.w, textureLoad(vertex_table, texel + vec2u(1u, 0u), 0).w);
    return Rasterised(views.clip[layer] * vec4f(corner.xyz, 1.0), index / 3u, uv);
}

@fragment
fn fragment(pixel: Rasterised) -> @location(0) u32 {
    //#if CUTOUTS
    if ((triangle_texel(pixel.triangle, 0u).w & CUT_OUT) != 0u && !is_solid(pixel.uv)) {
        discard;
    }
    //#end
    return pixel.triangle + 1u;
}
