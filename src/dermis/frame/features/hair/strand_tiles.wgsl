// Tiles of the picture, each with a linked list of the segments that may cover it.
//#include "strand_knots.wgsl"

override STRAND_TILE: u32 = 2u; // pixels a side

fn tiles_across(size: vec2f) -> u32 {
    return (u32(size.x) + STRAND_TILE - 1u) / STRAND_TILE;
}
