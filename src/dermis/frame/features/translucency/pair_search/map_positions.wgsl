// Positions in the atlas, stored as integers.

const FINE: i32 = 8; // steps per texel
const COPIES: u32 = 8u; // of a source in gutters, at most

fn unpacked(word: u32) -> vec2i {
    return vec2i(vec2u(word & 0xffffu, word >> 16u));
}
