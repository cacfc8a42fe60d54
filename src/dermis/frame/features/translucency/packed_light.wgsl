// Light in two words: three floats without their sign and with 13 bits of fraction, so that no scale has to fit them.

const LAST_BITS: u32 = 10u; // of a float's fraction, rounded off
const HIGH_HALF: u32 = 0xffe00000u; // the upper eleven of the 21 bits that are left

// light: not negative
fn light_words(light: vec3f) -> vec2u {
    let bits = bitcast<vec3u>(light) + (1u << (LAST_BITS - 1u));
    let low = (bits.rg >> vec2u(LAST_BITS)) & vec2u(~0u >> 11u);
    return low | (vec2u(bits.b << 11u, bits.b) & vec2u(HIGH_HALF));
}

fn light_of(words: vec2u) -> vec3f {
    let low = (words << vec2u(11u)) >> vec2u(1u);
    let b = ((words.x & HIGH_HALF) >> 11u) | (words.y & HIGH_HALF);
    return bitcast<vec3f>(vec3u(low, b));
}
