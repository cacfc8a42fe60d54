// Bounding box and normal cone of each block of tiles, from the boxes and cones of the tiles.
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> tiles: array<Bounds>;
@group(0) @binding(4) var<storage, read_write> blocks: array<Bounds>;

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= search.count) {
        return;
    }
    let begin = search.block * vec2u(index % search.blocks, index / search.blocks);
    let end = min(begin + search.block, vec2u(search.tiles));
    var bounds = empty_bounds();
    for (var y = begin.y; y < end.y; y++) {
        for (var x = begin.x; x < end.x; x++) {
            let tile = tiles[y * search.tiles + x];
            bounds.low = min(bounds.low, tile.low);
            bounds.high = max(bounds.high, tile.high);
            bounds.axis += tile.axis;
            bounds.occupied |= tile.occupied;
        }
    }
    bounds.axis = unit_or_zero(bounds.axis);
    var cosine = 1.0;
    for (var y = begin.y; y < end.y; y++) {
        for (var x = begin.x; x < end.x; x++) {
            let tile = tiles[y * search.tiles + x];
            if (tile.occupied > 0u) {
                cosine = min(cosine, widest_cosine(bounds.axis, tile));
            }
        }
    }
    if (bounds.occupied > 0u) {
        bounds = with_cone(bounds, cosine);
    }
    blocks[index] = bounds;
}

// Cosine of the widest angle between an axis and the normals of a tile.
fn widest_cosine(axis: vec3f, tile: Bounds) -> f32 {
    let between = clamp(dot(axis, tile.axis), -1.0, 1.0);
    let sine = sqrt(1.0 - between * between);
    let beyond = sine * tile.cosine + between * tile.sine < 0.0; // more than a half turn
    return select(between * tile.cosine - sine * tile.sine, -1.0, beyond);
}
