// Mesh as two textures: one of triangles, one of vertices.

@group(0) @binding(0) var triangle_table: texture_2d<u32>; // three tables above each other
@group(0) @binding(1) var vertex_table: texture_2d<f32>; // four texels: position u, normal v, dpdu, dpdv

// Tables: corners a, b, c and flags | material << 8; atlas positions of a and b; atlas position of c, texels per uv.
fn triangle_texel(index: u32, table: u32) -> vec4u {
    let size = textureDimensions(triangle_table);
    return textureLoad(triangle_table, vec2u(index % size.x, index / size.x + table * (size.y / 3u)), 0);
}

// First texel of a vertex.
fn vertex_texel(index: u32) -> vec2u {
    let per_row = textureDimensions(vertex_table).x / 4u;
    return vec2u(4u * (index % per_row), index / per_row);
}
