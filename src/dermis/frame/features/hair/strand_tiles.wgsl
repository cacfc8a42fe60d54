// The picture in tiles, each with chains of the pieces of hair that it may see.
//#include "strand_knots.wgsl"

//#fill const STRAND_TILE: u32 = {strand_tile}; // pixels a side

override WAYS: u32 = 1u; // chains of a tile: GPUs follow many side by side

fn tiles_across(size: vec2f) -> u32 {
    return (u32(size.x) + STRAND_TILE - 1u) / STRAND_TILE;
}
