// Vertices of the surface: positions, and normals and tangents from the triangles around each vertex.
//#include "each.wgsl"

override MESH_IN_BUFFERS: bool = false; // whether vertices are stored to the buffer, see geometry.wgsl
override MIN_DOUBLE_UV_AREA: f32; // least cross product of the uv sides of a triangle with defined tangents
override MIN_TANGENT: f32; // least length of dpdu without its part along the normal, relative to dpdu; shorter ones are replaced

const MIN_MM: f32 = 1e-6; // of dpdu and dpdv, per unit of uv

struct Vertex {
    uv: vec2f,
    point: u32,
    normal: vec3f, // in the frame of the smooth normal, the u direction across it, and their cross product
}

struct Tangents {
    u: vec3f, // [mm per unit of uv]
    v: vec3f,
}

@group(0) @binding(0) var<storage, read> points: array<f32>; // three floats per point [mm]
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> spans: array<vec4u>; // ranges of the corners at the vertex' point, and of those at the vertex itself
@group(0) @binding(3) var<storage, read> corners: array<vec2u>; // the other two vertices of the triangle
@group(0) @binding(4) var<storage, read_write> vertex_buffer: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> vertex_lengths: array<vec4f>; // of both tangents, and the cosine between them
@group(0) @binding(5) var vertex_table: texture_storage_2d<rgba32float, write>;

fn position_of(vertex: u32) -> vec3f {
    let at = 3u * vertices[vertex].point;
    return vec3f(points[at], points[at + 1u], points[at + 2u]);
}

// Mean normal of the triangles around a point, weighted by the angles of their corners.
fn smooth_normal(p: vec3f, span: vec2u) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = span.x; k < span.y; k++) {
        let a = position_of(corners[k].x) - p;
        let b = position_of(corners[k].y) - p;
        let c = cross(a, b);
        let twice = length(c);
        if (twice > 0.0) {
            sum += atan2(twice, dot(a, b)) / twice * c;
        }
    }
    let size = length(sum);
    return select(vec3f(0.0, 0.0, 1.0), sum / size, size > 0.0);
}

// A direction orthogonal to a normal.
fn orthogonal_to(n: vec3f) -> vec3f {
    let a = abs(n);
    var axis = vec3f(0.0, 0.0, 1.0);
    if (a.x <= a.y && a.x <= a.z) {
        axis = vec3f(1.0, 0.0, 0.0);
    } else if (a.y <= a.z) {
        axis = vec3f(0.0, 1.0, 0.0);
    }
    return normalize(cross(axis, n));
}

// Derivatives of position by u and v: mean over the triangles of the vertex, weighted by area.
fn tangents_of(index: u32, p: vec3f, n: vec3f, span: vec2u) -> Tangents {
    let uv = vertices[index].uv;
    var sum = Tangents(vec3f(0.0), vec3f(0.0));
    var total = 0.0;
    for (var k = span.x; k < span.y; k++) {
        let corner = corners[k];
        let a = position_of(corner.x) - p;
        let b = position_of(corner.y) - p;
        let s = vertices[corner.x].uv - uv;
        let t = vertices[corner.y].uv - uv;
        let in_uv = s.x * t.y - s.y * t.x;
        let area = length(cross(a, b));
        if (abs(in_uv) > MIN_DOUBLE_UV_AREA && area > 0.0) {
            sum.u += area / in_uv * (t.y * a - s.y * b);
            sum.v += area / in_uv * (s.x * b - t.x * a);
            total += area;
        }
    }
    let mean = Tangents(sum.u / max(total, 1e-30), sum.v / max(total, 1e-30));
    if (total > 0.0 && min(length(mean.u), length(mean.v)) >= MIN_MM) {
        return mean;
    }
    let u = orthogonal_to(n);
    return Tangents(u, cross(u, n));
}

// Normal of the vertex from its coordinates in the frame of the smooth normal.
fn normal_from_frame(own: vec3f, n: vec3f, dpdu: vec3f) -> vec3f {
    var tangent = dpdu - dot(dpdu, n) * n;
    let size = length(tangent);
    if (size > MIN_TANGENT * length(dpdu)) {
        tangent /= size;
    } else {
        tangent = orthogonal_to(n);
    }
    return normalize(own.x * n + own.y * tangent + own.z * cross(n, tangent));
}

fn store_row(index: u32, k: u32, row: vec4f) {
    if (MESH_IN_BUFFERS) {
        vertex_buffer[4u * index + k] = row;
    } else {
        let per_row = textureDimensions(vertex_table).x / 4u;
        textureStore(vertex_table, vec2u(4u * (index % per_row) + k, index / per_row), row);
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&vertices)) {
        return;
    }
    let vertex = vertices[index];
    let p = position_of(index);
    let span = spans[index];
    let n = smooth_normal(p, span.xy);
    let along = tangents_of(index, p, n, span.zw);
    let normal = normal_from_frame(vertex.normal, n, along.u);
    store_row(index, 0u, vec4f(p, vertex.uv.x));
    store_row(index, 1u, vec4f(normal, vertex.uv.y));
    store_row(index, 2u, vec4f(along.u, 0.0));
    store_row(index, 3u, vec4f(along.v, 0.0));
    let lengths = vec2f(length(along.u), length(along.v));
    vertex_lengths[index] = vec4f(lengths, dot(along.u, along.v) / max(lengths.x * lengths.y, 1e-12), 0.0);
}
