// A pair's source in the low bits of a word, and in the high ones how far light on its way is as in a deep slab.

const SOURCE_BITS: u32 = 24u;
const SOURCE: u32 = 0xffffffu;
const DEEPEST: f32 = 127.0; // stands for 1

// deep: -1 to 1; 1 where directions count as in a deep slab, 0 where all count alike
fn pair_word(source: u32, deep: f32) -> u32 {
    return source | (bitcast<u32>(i32(round(DEEPEST * deep))) << SOURCE_BITS);
}
