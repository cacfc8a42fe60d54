// Tiles of the picture, each with linked lists of the segments that may cover it.
//#include "strand_knots.wgsl"

//#fill const TEAM_TILE: u32 = {strand_tile}; // pixels a side of tiles that are drawn by workgroups

override STRAND_TILE: u32 = TEAM_TILE; // pixels a side: fewer on software adapters
override SEGMENT_LISTS: u32 = 1u; // linked lists of a tile: GPUs follow many side by side

fn tiles_across(size: vec2f) -> u32 {
    return (u32(size.x) + STRAND_TILE - 1u) / STRAND_TILE;
}
