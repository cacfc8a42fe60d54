// Division of the atlas into coarse cells.
//#include "each.wgsl"

struct Cells {
    size: u32, // texels along the side of the atlas
    side: u32, // cells along the side of the atlas
    stride: u32, // texels between the samples of a source
    count: u32, // number of invocations
}

@group(0) @binding(2) var<uniform> cells: Cells;

fn unpacked(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}

fn packed(pair: vec2u) -> u32 {
    return pair.x | (pair.y << 16u);
}

// First texel of a cell.
fn first_texel(cell: vec2u) -> vec2u {
    return (cell * cells.size + cells.side - 1u) / cells.side;
}

fn middle_texel(cell: vec2u) -> vec2u {
    return ((2u * cell + 1u) * cells.size) / (2u * cells.side);
}
