// Copies buffers to the layers of a texture, one workgroup per tile. Tiles in which something was drawn are copied, tiles that
// still show the last frame are cleared, and all other tiles are already empty.
//#include "tiles.wgsl"

@group(0) @binding(34) var<storage, read_write> tiles: array<u32>;

const ROWS: u32 = 4u; // of a workgroup

@compute @workgroup_size(TILE.x, ROWS)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
    let tile = tile_at(group.xy, group.z);
    let state = tiles[tile];
    storageBarrier(); // until all invocations have read it
    if (all(lane == vec3u(0u))) {
        tiles[tile] = select(0u, HELD, state == DRAWN);
    }
    if (state == 0u) {
        return;
    }
    for (var y = lane.y; y < TILE.y; y += 4u * ROWS) {
        resolve(group.xy * TILE + vec2u(lane.x, y), group.z, state == DRAWN);
    }
}

// Four pixels of a column, loaded together so that the loads overlap.
fn resolve(pixel: vec2u, layer: u32, drawn: bool) {
    let rows = pixel.y + vec4u(0u, 1u, 2u, 3u) * ROWS;
    let at = (layer * views.height + rows) * views.width + pixel.x;
    let inside = (rows < vec4u(views.height)) & vec4<bool>(pixel.x < views.width);
    let full = inside & vec4<bool>(drawn);
    let bits = vec4u(read(full.x, at.x), read(full.y, at.y), read(full.z, at.z), read(full.w, at.w));
    for (var k = 0u; k < 4u; k++) {
        if (inside[k]) {
            store(vec2u(pixel.x, rows[k]), layer, bits[k]);
        }
        if (full[k]) {
            clear(at[k]);
        }
    }
}

fn read(full: bool, at: u32) -> u32 {
    if (full) {
        return value_at(at);
    }
    return 0u;
}
