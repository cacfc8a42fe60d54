// Draws a part of an atlas layer as a flat image with square texels.
//#include "layer_colours.wgsl"

const MAX_SAMPLES: u32 = 8u; // maximum per side of a pixel that covers many texels
const BACKGROUND: vec3f = vec3f(0.13); // outside the atlas

struct AtlasView {
    centre: vec2f,
    span: f32, // part of the atlas along the shorter image side, 1 for its whole side
    quantity: u32,
    scale: f32,
}

@group(0) @binding(0) var<uniform> atlas_view: AtlasView;
@group(0) @binding(1) var layer: texture_2d<f32>;
@group(0) @binding(2) var bytes: texture_storage_2d<rgba8uint, write>;

fn colour_at(uv: vec2f) -> vec3f {
    if (any(uv < vec2f(0.0)) || any(uv >= vec2f(1.0))) {
        return BACKGROUND;
    }
    let value = textureLoad(layer, vec2u(uv * vec2f(textureDimensions(layer))), 0);
    return clamp(layer_colour(atlas_view.quantity, value, atlas_view.scale), vec3f(0.0), vec3f(1.0));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2f(textureDimensions(bytes));
    if (any(vec2f(id.xy) >= size)) {
        return;
    }
    let pixel = atlas_view.span / min(size.x, size.y);
    let texels = pixel * f32(textureDimensions(layer).y);
    let count = clamp(u32(ceil(texels)), 1u, MAX_SAMPLES);
    var sum = vec3f(0.0);
    for (var k = 0u; k < count * count; k++) {
        let offset = (vec2f(vec2u(k % count, k / count)) + 0.5) / f32(count);
        sum += colour_at(atlas_view.centre + pixel * (vec2f(id.xy) + offset - 0.5 * size));
    }
    textureStore(bytes, id.xy, vec4u(vec3u(round(255.0 * sum / f32(count * count))), 255u));
}
