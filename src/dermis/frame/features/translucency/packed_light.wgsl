// Light packed in two words: three unsigned floats with 13 bits of mantissa each, which need no common scale.

const DROPPED_BITS: u32 = 10u; // of the mantissa
const HIGH_HALF: u32 = 0xffe00000u; // the upper 11 of the remaining 21 bits

// light: not negative
fn pack_light(light: vec3f) -> vec2u {
    let bits = bitcast<vec3u>(light) + (1u << (DROPPED_BITS - 1u));
    let low = (bits.rg >> vec2u(DROPPED_BITS)) & vec2u(~0u >> 11u);
    return low | (vec2u(bits.b << 11u, bits.b) & vec2u(HIGH_HALF));
}

fn unpack_light(words: vec2u) -> vec3f {
    let low = (words << vec2u(11u)) >> vec2u(1u);
    let b = ((words.x & HIGH_HALF) >> 11u) | (words.y & HIGH_HALF);
    return bitcast<vec3f>(vec3u(low, b));
}
