// Tiles of the picture, each with linked lists of the segments that may cover it.
//#include "strand_knots.wgsl"

//#fill const STRAND_TILE: u32 = {strand_tile}; // pixels a side

override SEGMENT_LISTS: u32 = 1u; // linked lists of a tile: GPUs follow many side by side

fn tiles_across(size: vec2f) -> u32 {
    return (u32(size.x) + STRAND_TILE - 1u) / STRAND_TILE;
}
