// The surface that skin is painted on: a human's triangles, and where on the average person their corners are.

const MARGIN: f32 = 8.0; // texels around charts that are painted too
const ID_BITS: u32 = 20u;
const NEAREST: u32 = 0xfffu;
const STEPS: f32 = 256.0; // of a texel, that distances are told apart by

struct Paint {
    side: u32, // of the maps [texels]
    seed: u32,
    melanin: f32, // fields of SkinLook from here on
    blood: f32,
    redness: f32,
    freckles: f32,
    moles: f32,
    spots: f32,
    tan: f32,
    veins: f32,
    stubble: f32,
    beard: f32,
    oil: f32,
    age: f32,
}

struct Vertex {
    uv: vec2f,
    place: vec3f, // on the average person [mm]
    normal: vec3f,
    fields: vec3f, // distances [mm], see human/skin/surface.py
    density: f32, // binary logarithm of the mm in a unit of uv
}

@group(0) @binding(0) var<uniform> paint: Paint;
@group(0) @binding(1) var<storage, read> vertices: array<f32>; // twelve of each
@group(0) @binding(2) var<storage, read> triangles: array<u32>; // three corners, and 1 at a chart's border

fn triangle_of(index: u32) -> vec4u {
    let at = 4u * index;
    return vec4u(triangles[at], triangles[at + 1u], triangles[at + 2u], triangles[at + 3u]);
}

fn uv_of(index: u32) -> vec2f {
    return vec2f(vertices[12u * index], vertices[12u * index + 1u]);
}

fn three(at: u32) -> vec3f {
    return vec3f(vertices[at], vertices[at + 1u], vertices[at + 2u]);
}

fn vertex_of(index: u32) -> Vertex {
    let at = 12u * index;
    return Vertex(uv_of(index), three(at + 2u), three(at + 5u), three(at + 8u), vertices[at + 11u]);
}
