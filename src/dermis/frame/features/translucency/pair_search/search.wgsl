// What a search for translucent pairs is told.

struct Search {
    radius_mm: f32,
    variance_mm2: f32, // of the widest Gaussian
    tile: f32, // side in the map, which has 1
    beside: f32, // by which it may show more than it covers, likewise
    tiles: u32, // along a side of the atlas
    blocks: u32, // along a side, each of some tiles
    block: u32, // tiles along the side of a block
    count: u32, // of what is looked at: tiles, receivers, pairs
}

@group(0) @binding(2) var<uniform> search: Search;

const TURN: f32 = 0.05; // cosines by which normals may turn when the surface moves
const LEAST: f32 = 4e-5; // share of a source's light that a pair must let pass to count
