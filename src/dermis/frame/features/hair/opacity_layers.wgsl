// Texels of deep opacity maps: the depth of the nearest strand, and the cover by strands in several layers behind it.
// Source: [YukselKeyser2008].

//#fill const HAIR_LAYERS: u32 = {strand_layers}; // layers of depth behind the nearest strand of a texel
const TEXEL_WORDS: u32 = 1u + HAIR_LAYERS; // depth of the nearest strand, then the cover of each layer
const FIRST_LAYER_MM: f32 = 1.0; // thickness of the first layer; each further one is twice as thick
const COVER_SCALE: f32 = 4096.0; // integer of a cover of 1
const DEPTH_SCALE: f32 = 256.0; // integer steps of depth per millimetre
const NO_HAIR: u32 = 0xffffffffu; // depth of the nearest strand where there is none

// Layer at a depth behind the nearest strand of a texel, with its fraction.
fn layer_at(behind_mm: f32) -> f32 {
    return log2(1.0 + max(behind_mm, 0.0) / FIRST_LAYER_MM);
}
