// The atlas in coarse cells.
//#include "each.wgsl"

struct Cells {
    size: u32, // texels along the atlas' side
    side: u32, // cells
    stride: u32, // between the texels that sources are made of
    count: u32, // of what is asked for
}

@group(0) @binding(2) var<uniform> cells: Cells;

fn unpacked(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}

fn packed(pair: vec2u) -> u32 {
    return pair.x | (pair.y << 16u);
}

// The first texel of a cell.
fn first_of(cell: vec2u) -> vec2u {
    return (cell * cells.size + cells.side - 1u) / cells.side;
}

fn middle_of(cell: vec2u) -> vec2u {
    return ((2u * cell + 1u) * cells.size) / (2u * cells.side);
}
