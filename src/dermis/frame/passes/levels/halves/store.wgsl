// Light stored as halves. Some adapters truncate floats when they store them, so that each pass would lose energy: here
// they are rounded first, which leaves nothing to truncate.

@group(0) @binding(32) var stored: texture_storage_2d<rgba16float, write>;

const LARGEST: f32 = 65504.0; // half float

fn store(at: vec2u, light: vec4f) {
    let bits = bitcast<vec4u>(min(light, vec4f(LARGEST)));
    let odd = (bits >> vec4u(13u)) & vec4u(1u); // ties to even
    textureStore(stored, at, bitcast<vec4f>((bits + 0xfffu + odd) & vec4u(0xffffe000u)));
}
