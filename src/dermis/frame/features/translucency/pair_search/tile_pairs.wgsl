// For each tile, the number or the list of those tiles with which translucent pairs are possible.
//#include "bounds.wgsl"

override LISTED: bool = false; // whether to write the list instead of the number

@group(0) @binding(3) var<storage, read> tiles: array<Bounds>;
@group(0) @binding(4) var<storage, read> block_pairs: array<u32>; // see block_pairs.wgsl
@group(0) @binding(5) var<storage, read> queries: array<vec2u>; // tile, and offset of its list
@group(0) @binding(6) var<storage, read_write> partners: array<u32>; // numbers, or lists of tiles

var<private> tile: Bounds;
var<private> next: u32;

fn add_partner(other: u32) {
    if (may_pair(tile, tiles[other])) {
        if (LISTED) {
            partners[next] = other;
        }
        next++;
    }
}

fn add_block_partners(index: u32) {
    let begin = search.block * vec2u(index % search.blocks, index / search.blocks);
    let end = min(begin + search.block, vec2u(search.tiles));
    for (var y = begin.y; y < end.y; y++) {
        for (var x = begin.x; x < end.x; x++) {
            add_partner(y * search.tiles + x);
        }
    }
}

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
    let query = queries[index];
    tile = tiles[query.x];
    next = query.y;
    let block = (query.x / search.tiles / search.block) * search.blocks + (query.x % search.tiles) / search.block;
    let words = (search.blocks * search.blocks + 31u) / 32u;
    for (var k = 0u; k < words; k++) {
        var bits = block_pairs[block * words + k];
        while (bits != 0u) {
            let bit = firstTrailingBit(bits);
            bits &= bits - 1u;
            add_block_partners(32u * k + bit);
        }
    }
    if (!LISTED) {
        partners[index] = next - query.y;
    }
}
