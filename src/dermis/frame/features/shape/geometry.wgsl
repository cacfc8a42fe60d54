// Surface points of the mesh, given by triangle and barycentric weights.
//#include "mesh_textures.wgsl"

override MESH_IN_BUFFERS: bool = false; // whether the mesh is read from buffers, which is faster on GPUs

const MAPPED: u32 = 1u; // the triangle has texels in the atlas
const OPAQUE: u32 = 2u; // plain material, no scattering

@group(0) @binding(23) var<storage, read> triangle_buffer: array<vec4u>; // same content as the textures
@group(0) @binding(24) var<storage, read> vertex_buffer: array<vec4f>;

struct Corner {
    position: vec3f,
    normal: vec3f,
    uv: vec2f,
    dpdu: vec3f,
    dpdv: vec3f,
}

struct Point {
    position: vec3f, // [mm]
    lit_position: vec3f, // on the smooth surface, start of shadow rays
    normal: vec3f, // interpolated, unit
    uv: vec2f, // in the maps
    atlas_uv: vec2f, // in the atlas, set only by passes that need it
    dpdu: vec3f, // [mm per unit of uv]
    dpdv: vec3f,
    curvature: f32, // root mean square over directions [1/mm], set only by the shading of pre-integrated skin
    flags: u32,
}

fn triangle_row(index: u32, table: u32) -> vec4u {
    if (MESH_IN_BUFFERS) {
        return triangle_buffer[table * (arrayLength(&triangle_buffer) / 3u) + index];
    }
    return triangle_texel(index, table);
}

fn triangle_at(index: u32) -> vec4u {
    return triangle_row(index, 0u);
}

// Position in the atlas, from 0 to 1, of a point of a triangle.
fn atlas_position(index: u32, w: vec3f) -> vec2f {
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let c = bitcast<vec4f>(triangle_row(index, 2u));
    return w.x * ab.xy + w.y * ab.zw + w.z * c.xy;
}

// Texels of the atlas per unit of uv.
fn texels_per_uv(index: u32) -> f32 {
    return bitcast<f32>(triangle_row(index, 2u).z);
}

fn position_of(index: u32) -> vec3f {
    if (MESH_IN_BUFFERS) {
        return vertex_buffer[4u * index].xyz;
    }
    return textureLoad(vertex_table, vertex_texel(index), 0).xyz;
}

fn corner_at(index: u32) -> Corner {
    if (MESH_IN_BUFFERS) {
        let at = 4u * index;
        return corner_of(vertex_buffer[at], vertex_buffer[at + 1u], vertex_buffer[at + 2u], vertex_buffer[at + 3u]);
    }
    let at = vertex_texel(index);
    return corner_of(
        textureLoad(vertex_table, at, 0),
        textureLoad(vertex_table, at + vec2u(1u, 0u), 0),
        textureLoad(vertex_table, at + vec2u(2u, 0u), 0),
        textureLoad(vertex_table, at + vec2u(3u, 0u), 0),
    );
}

fn corner_of(p: vec4f, n: vec4f, du: vec4f, dv: vec4f) -> Corner {
    return Corner(p.xyz, n.xyz, vec2f(p.w, n.w), du.xyz, dv.xyz);
}

// Size of a triangle in the maps relative to its size in the atlas.
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
    // facets would shadow themselves where the smooth normal faces the light: shadow rays start on the curved surface
    // that the corner normals define [Hanika2021]
    point.lit_position = w.x * lifted(p, a) + w.y * lifted(p, b) + w.z * lifted(p, c);
    point.normal = normalize(w.x * a.normal + w.y * b.normal + w.z * c.normal);
    point.uv = w.x * a.uv + w.y * b.uv + w.z * c.uv;
    point.dpdu = w.x * a.dpdu + w.y * b.dpdu + w.z * c.dpdu;
    point.dpdv = w.x * a.dpdv + w.y * b.dpdv + w.z * c.dpdv;
    point.flags = flags;
    return point;
}

// The barycentric weights at which a ray from the eye meets the plane of a triangle are linear in the ray, up to scale. They
// are computed from the sides: products of distant corners would lose all precision.
fn ray_to_weights(eye: vec3f, a: vec3f, b: vec3f, c: vec3f) -> mat3x3f {
    let away = a - eye;
    let to_b = cross(c - a, away);
    let to_c = cross(away, b - a);
    return transpose(mat3x3f(cross(b - a, c - a) - to_b - to_c, to_b, to_c));
}

const MAX_BARYCENTRIC: f32 = 1e4; // limit for rays that are parallel to the plane

fn meet(weights: mat3x3f, ray: vec3f) -> vec3f {
    let w = weights * ray;
    let sum = w.x + w.y + w.z;
    let scaled = w / select(sum, 1e-20, abs(sum) < 1e-20);
    return clamp(scaled, vec3f(-MAX_BARYCENTRIC), vec3f(MAX_BARYCENTRIC));
}

// Weights clamped to the triangle.
fn within(w: vec3f) -> vec3f {
    let clamped = max(w, vec3f(0.0));
    let sum = clamped.x + clamped.y + clamped.z;
    return select(vec3f(1.0 / 3.0), clamped / max(sum, 1e-20), sum > 0.0);
}
