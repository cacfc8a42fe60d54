// Packs pixels to bytes with straight alpha, which means that colours are divided by the coverage.
//#include "post/encoding.wgsl"

const ROW: u32 = 1024u; // invocations of a row

struct Straight {
    tone: u32,
    encoded: u32, // 0 omits the sRGB encoding, an intentional error for comparisons
}

@group(0) @binding(0) var<uniform> settings: Straight;
@group(0) @binding(1) var exposed: texture_2d<f32>; // linear, premultiplied by the coverage
@group(0) @binding(2) var<storage, read_write> packed: array<u32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    let size = textureDimensions(exposed);
    if (index >= size.x * size.y) {
        return;
    }
    let texel = textureLoad(exposed, vec2u(index % size.x, index / size.x), 0);
    let colour = select(vec3f(0.0), texel.rgb / max(texel.a, 1e-6), texel.a > 0.0);
    let colour_bytes = display_bytes(colour, settings.tone, settings.encoded);
    packed[index] = colour_bytes.r | (colour_bytes.g << 8u) | (colour_bytes.b << 16u) | (u32(round(255.0 * texel.a)) << 24u);
}
