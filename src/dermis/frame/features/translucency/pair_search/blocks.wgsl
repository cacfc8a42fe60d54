// What each block of tiles shows: a box and a cone around theirs.
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> tiles: array<Bounds>;
@group(0) @binding(4) var<storage, read_write> blocks: array<Bounds>;

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= search.count) {
        return;
    }
    let begin = search.block * vec2u(index % search.blocks, index / search.blocks);
    let end = min(begin + search.block, vec2u(search.tiles));
    var made = nothing();
    for (var y = begin.y; y < end.y; y++) {
        for (var x = begin.x; x < end.x; x++) {
            let tile = tiles[y * search.tiles + x];
            made.low = min(made.low, tile.low);
            made.high = max(made.high, tile.high);
            made.axis += tile.axis;
            made.any |= tile.any;
        }
    }
    made.axis = unit_or_zero(made.axis);
    var cosine = 1.0;
    for (var y = begin.y; y < end.y; y++) {
        for (var x = begin.x; x < end.x; x++) {
            let tile = tiles[y * search.tiles + x];
            if (tile.any > 0u) {
                cosine = min(cosine, farthest(made.axis, tile));
            }
        }
    }
    if (made.any > 0u) {
        made = coned(made, cosine);
    }
    blocks[index] = made;
}

// Cosine of the widest angle between an axis and a tile's normals.
fn farthest(axis: vec3f, tile: Bounds) -> f32 {
    let between = clamp(dot(axis, tile.axis), -1.0, 1.0);
    let sine = sqrt(1.0 - between * between);
    let past = sine * tile.cosine + between * tile.sine < 0.0; // more than a half turn
    return select(between * tile.cosine - sine * tile.sine, -1.0, past);
}
