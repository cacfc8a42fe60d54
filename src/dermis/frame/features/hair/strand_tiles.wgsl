// Tiles of the picture, each with a linked list of the segments that may cover it.
//#include "strand_knots.wgsl"

//#fill const STRAND_TILE: u32 = {strand_tile}; // pixels a side

fn tiles_across(size: vec2f) -> u32 {
    return (u32(size.x) + STRAND_TILE - 1u) / STRAND_TILE;
}
