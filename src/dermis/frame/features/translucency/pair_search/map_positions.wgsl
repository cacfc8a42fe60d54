// Places in the map.

const FINE: i32 = 8; // parts of a texel
const COPIES: u32 = 8u; // in gutters, of each source at most

fn unpacked(word: u32) -> vec2i {
    return vec2i(vec2u(word & 0xffffu, word >> 16u));
}
