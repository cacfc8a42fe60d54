// The tiles that each tile may have translucent pairs with: how many there are, or which.
//#include "bounds.wgsl"

override LISTED: bool = false; // whether they are written down

@group(0) @binding(3) var<storage, read> tiles: array<Bounds>;
@group(0) @binding(4) var<storage, read> near: array<u32>; // blocks, as block_pairs.wgsl has them
@group(0) @binding(5) var<storage, read> asked: array<vec2u>; // tile, and where its list begins
@group(0) @binding(6) var<storage, read_write> facing: array<u32>; // counts, or lists

var<private> tile: Bounds;
var<private> next: u32;

fn add(other: u32) {
    if (may_pair(tile, tiles[other])) {
        if (LISTED) {
            facing[next] = other;
        }
        next++;
    }
}

fn add_block(index: u32) {
    let begin = search.block * vec2u(index % search.blocks, index / search.blocks);
    let end = min(begin + search.block, vec2u(search.tiles));
    for (var y = begin.y; y < end.y; y++) {
        for (var x = begin.x; x < end.x; x++) {
            add(y * search.tiles + x);
        }
    }
}

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
    let own = asked[index];
    tile = tiles[own.x];
    next = own.y;
    let block = (own.x / search.tiles / search.block) * search.blocks + (own.x % search.tiles) / search.block;
    let words = (search.blocks * search.blocks + 31u) / 32u;
    for (var k = 0u; k < words; k++) {
        var bits = near[block * words + k];
        while (bits != 0u) {
            let bit = firstTrailingBit(bits);
            bits &= bits - 1u;
            add_block(32u * k + bit);
        }
    }
    if (!LISTED) {
        facing[index] = next - own.y;
    }
}
