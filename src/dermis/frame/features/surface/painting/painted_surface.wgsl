// Surface that is painted: triangles of a human mesh, with the positions of their corners on the average person.

const MARGIN: f32 = 8.0; // width around charts that is painted too [texels]
const ID_BITS: u32 = 20u;
const NEAREST: u32 = 0xfffu;
const STEPS: f32 = 256.0; // steps per texel of quantised distances

struct Paint {
    side: u32, // of the maps [texels]
    seed: u32,
    melanin: f32, // this and the following: fields of SkinLook
    blood: f32,
    oxygen: f32,
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
    blemishes: f32,
    scars: f32,
    low_oxygen: f32, // oxygen saturations of the two colour tables of skin
    high_oxygen: f32,
    stubble_colour: vec3f, // reflectance of a scalp covered by short hair
    bands: array<vec4f, 3>, // matrix from RGB colours to the channels of the maps, by rows
}

struct Vertex {
    uv: vec2f,
    position: vec3f, // on the average person [mm]
    normal: vec3f,
    fields: vec3f, // distances [mm], see human/skin/surface.py
    density: f32, // log2 of the mm per unit of uv
}

@group(0) @binding(0) var<uniform> paint: Paint;
@group(0) @binding(1) var<storage, read> vertices: array<f32>; // twelve floats per vertex
@group(0) @binding(2) var<storage, read> triangles: array<u32>; // three corners, and 1 at the border of a chart

fn triangle_of(index: u32) -> vec4u {
    let at = 4u * index;
    return vec4u(triangles[at], triangles[at + 1u], triangles[at + 2u], triangles[at + 3u]);
}

fn uv_of(index: u32) -> vec2f {
    return vec2f(vertices[12u * index], vertices[12u * index + 1u]);
}

fn vector_at(at: u32) -> vec3f {
    return vec3f(vertices[at], vertices[at + 1u], vertices[at + 2u]);
}

fn vertex_of(index: u32) -> Vertex {
    let at = 12u * index;
    return Vertex(uv_of(index), vector_at(at + 2u), vector_at(at + 5u), vector_at(at + 8u), vertices[at + 11u]);
}
