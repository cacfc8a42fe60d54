// Parameters of a search for translucent pairs.

struct Search {
    radius_mm: f32, // largest distance of a pair
    variance_mm2: f32, // of the widest Gaussian
    tile: f32, // side of a tile, in units of the side of the atlas
    margin: f32, // width around a tile in which triangles also count as inside, in the same unit
    tiles: u32, // tiles along a side of the atlas
    blocks: u32, // blocks of tiles along a side of the atlas
    block: u32, // tiles along a side of a block
    count: u32, // number of invocations: tiles, receivers, pairs
}

@group(0) @binding(2) var<uniform> search: Search;

const TURN_MARGIN: f32 = 0.05; // tolerance of cosines, for normals that turn when the surface moves
const MIN_FRACTION: f32 = 4e-5; // least fraction of the light of a source that a pair has to transmit
