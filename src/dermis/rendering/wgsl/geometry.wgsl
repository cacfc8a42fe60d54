// The mesh as two textures, and points of its surface by triangle and barycentric weights.

const MAPPED: u32 = 1u; // the triangle has texels in the atlas
const OPAQUE: u32 = 2u; // plain material, no scattering

@group(0) @binding(0) var triangle_table: texture_2d<u32>; // three tables, see below
@group(0) @binding(1) var vertex_table: texture_2d<f32>; // four texels: position u, normal v, dpdu curvature, dpdv

struct Corner {
    position: vec3f,
    normal: vec3f,
    uv: vec2f,
    dpdu: vec3f,
    dpdv: vec3f,
    curvature: f32,
}

struct Point {
    position: vec3f, // [mm]
    lit_position: vec3f, // moved onto the smooth surface, for shadow rays
    normal: vec3f, // interpolated, unit
    uv: vec2f, // in the maps
    place: vec2f, // in the atlas, where someone asked for it
    dpdu: vec3f, // [mm per unit of uv]
    dpdv: vec3f,
    curvature: f32, // root mean square over directions [1/mm]
    flags: u32,
}

// Of three tables one over the other: corners a, b, c and flags | material << 8; atlas places of a and b; that of c.
fn triangle_row(index: u32, table: u32) -> vec4u {
    let size = textureDimensions(triangle_table);
    return textureLoad(triangle_table, vec2u(index % size.x, index / size.x + table * (size.y / 3u)), 0);
}

fn triangle_at(index: u32) -> vec4u {
    return triangle_row(index, 0u);
}

// Where in the atlas, from 0 to 1, the light of a point of a triangle is.
fn place_of_point(index: u32, w: vec3f) -> vec2f {
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let c = bitcast<vec4f>(triangle_row(index, 2u));
    return w.x * ab.xy + w.y * ab.zw + w.z * c.xy;
}

fn vertex_texel(index: u32) -> vec2u {
    let per_row = textureDimensions(vertex_table).x / 4u;
    return vec2u(4u * (index % per_row), index / per_row);
}

fn position_of(index: u32) -> vec3f {
    return textureLoad(vertex_table, vertex_texel(index), 0).xyz;
}

fn corner_at(index: u32) -> Corner {
    let at = vertex_texel(index);
    let p = textureLoad(vertex_table, at, 0);
    let n = textureLoad(vertex_table, at + vec2u(1u, 0u), 0);
    let du = textureLoad(vertex_table, at + vec2u(2u, 0u), 0);
    let dv = textureLoad(vertex_table, at + vec2u(3u, 0u), 0);
    return Corner(p.xyz, n.xyz, vec2f(p.w, n.w), du.xyz, dv.xyz, du.w);
}

// Side of a triangle in the maps over its side in the atlas.
fn maps_over_atlas(index: u32, a: Corner, b: Corner, c: Corner) -> f32 {
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let ac = bitcast<vec4f>(triangle_row(index, 2u)).xy - ab.xy;
    let in_atlas = determinant(mat2x2f(ab.zw - ab.xy, ac));
    let in_maps = determinant(mat2x2f(b.uv - a.uv, c.uv - a.uv));
    return sqrt(abs(in_maps / in_atlas));
}

fn lifted(p: vec3f, corner: Corner) -> vec3f {
    return p - min(0.0, dot(p - corner.position, corner.normal)) * corner.normal;
}

fn interpolate(a: Corner, b: Corner, c: Corner, w: vec3f, flags: u32) -> Point {
    let p = w.x * a.position + w.y * b.position + w.z * c.position;
    var point: Point;
    point.position = p;
    // Facets shade themselves where the smooth normal still sees the light: shadow rays start on the
    // curved surface that the corner normals suggest [Hanika2021].
    point.lit_position = w.x * lifted(p, a) + w.y * lifted(p, b) + w.z * lifted(p, c);
    point.normal = normalize(w.x * a.normal + w.y * b.normal + w.z * c.normal);
    point.uv = w.x * a.uv + w.y * b.uv + w.z * c.uv;
    point.dpdu = w.x * a.dpdu + w.y * b.dpdu + w.z * c.dpdu;
    point.dpdv = w.x * a.dpdv + w.y * b.dpdv + w.z * c.dpdv;
    point.curvature = w.x * a.curvature + w.y * b.curvature + w.z * c.curvature;
    point.flags = flags;
    return point;
}
