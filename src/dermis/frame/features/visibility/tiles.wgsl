// Tiles of the pixels of a view, so that empty tiles can be skipped.
//#include "views.wgsl"

const TILE: vec2u = vec2u(64u, 32u); // pixels
const HELD: u32 = 1u; // state of a tile: the texture holds pixels of the last frame
const DRAWN: u32 = 2u; // something was drawn into the buffers

fn tile_at(tile: vec2u, layer: u32) -> u32 {
    let count = (vec2u(views.width, views.height) + TILE - 1u) / TILE;
    return (layer * count.y + tile.y) * count.x + tile.x;
}
