// Scales the rendered image to the texture of the window.
//#include "bilinear.wgsl"

override DECODED: bool = false; // whether the target encodes linear values as sRGB

@group(0) @binding(0) var image: texture_2d<u32>; // sRGB bytes

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2f(vec2u((index << 1u) & 2u, index & 2u)); // one triangle that covers the window
    return Corner(vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0), uv);
}

fn texel(index: vec2i) -> vec3f {
    let last = vec2i(textureDimensions(image)) - 1;
    return vec3f(textureLoad(image, clamp(index, vec2i(0), last), 0).rgb) / 255.0;
}

fn decode_srgb(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let position = corner.uv * vec2f(textureDimensions(image)) - 0.5;
    let a = vec2i(floor(position));
    let w = bilinear_weights(position);
    let colour = w.x * texel(a) + w.y * texel(a + vec2i(1, 0)) + w.z * texel(a + vec2i(0, 1)) + w.w * texel(a + 1);
    return vec4f(select(colour, decode_srgb(colour), DECODED), 1.0);
}
