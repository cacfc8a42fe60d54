// Draws part of an atlas layer as a flat picture, its texels as squares.
//#include "layer_colours.wgsl"

const MOST_SAMPLES: u32 = 8u; // along each side of a pixel that covers many texels
const BESIDE: vec3f = vec3f(0.13); // around the atlas

struct Sheet {
    centre: vec2f,
    span: f32, // sides of the atlas over the picture's shorter side
    what: u32,
    scale: f32,
}

@group(0) @binding(0) var<uniform> sheet: Sheet;
@group(0) @binding(1) var layer: texture_2d<f32>;
@group(0) @binding(2) var bytes: texture_storage_2d<rgba8uint, write>;

fn colour_at(place: vec2f) -> vec3f {
    if (any(place < vec2f(0.0)) || any(place >= vec2f(1.0))) {
        return BESIDE;
    }
    let value = textureLoad(layer, vec2u(place * vec2f(textureDimensions(layer))), 0);
    return clamp(layer_colour(sheet.what, value, sheet.scale), vec3f(0.0), vec3f(1.0));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2f(textureDimensions(bytes));
    if (any(vec2f(id.xy) >= size)) {
        return;
    }
    let pixel = sheet.span / min(size.x, size.y);
    let texels = pixel * f32(textureDimensions(layer).y);
    let count = clamp(u32(ceil(texels)), 1u, MOST_SAMPLES);
    var sum = vec3f(0.0);
    for (var k = 0u; k < count * count; k++) {
        let part = (vec2f(vec2u(k % count, k / count)) + 0.5) / f32(count);
        sum += colour_at(sheet.centre + pixel * (vec2f(id.xy) + part - 0.5 * size));
    }
    textureStore(bytes, id.xy, vec4u(vec3u(round(255.0 * sum / f32(count * count))), 255u));
}
