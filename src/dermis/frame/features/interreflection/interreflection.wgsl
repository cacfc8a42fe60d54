// Light that arrives from other skin, by position in the atlas.
//#include "bilinear.wgsl"

override INTERREFLECTION: bool = false; // whether there is interreflection

//#fill const LINKED_SIDE: i32 = {linked_side}; // cells along the side of the uv square

@group(0) @binding(27) var<storage, read> from_skin: array<vec4f>; // irradiance of the cells, row by row, times their confidence; alpha is the confidence

fn from_skin_cell(at: vec2i) -> vec4f {
    let cell = clamp(at, vec2i(0), vec2i(LINKED_SIDE - 1));
    return from_skin[cell.y * LINKED_SIDE + cell.x];
}

// Irradiance at a position of the atlas, interpolated between the cells that have surface.
fn from_skin_at(uv: vec2f) -> vec3f {
    let position = uv * f32(LINKED_SIDE) - 0.5;
    let a = vec2i(floor(position));
    let w = bilinear_weights(position);
    let light = w.x * from_skin_cell(a) + w.y * from_skin_cell(a + vec2i(1, 0))
        + w.z * from_skin_cell(a + vec2i(0, 1)) + w.w * from_skin_cell(a + vec2i(1, 1));
    return light.rgb / max(light.a, 1e-6);
}
