// Source of a pair in the low bits of a word, and the directionality of its transmittance in the high bits.

const SOURCE_BITS: u32 = 24u;
const SOURCE_MASK: u32 = 0xffffffu;
const DIRECTIONALITY_SCALE: f32 = 127.0; // integer of 1

// directionality: -1 to 1; 1 where directions of incidence weigh as in a deep slab, 0 where all weigh the same
fn pack_pair(source: u32, directionality: f32) -> u32 {
    return source | (bitcast<u32>(i32(round(DIRECTIONALITY_SCALE * directionality))) << SOURCE_BITS);
}
