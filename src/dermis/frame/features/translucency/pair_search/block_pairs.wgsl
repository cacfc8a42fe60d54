// One bit for each pair of blocks of tiles, set if translucent pairs between the two blocks are possible.
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> blocks: array<Bounds>;
@group(0) @binding(4) var<storage, read_write> block_pairs: array<u32>; // a row of words for each block

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    let all = search.blocks * search.blocks;
    let words = (all + 31u) / 32u;
    if (index >= search.count) {
        return;
    }
    let block = blocks[index / words];
    let first = 32u * (index % words);
    var bits = 0u;
    for (var k = first; k < min(first + 32u, all); k++) {
        bits |= select(0u, 1u, may_pair(block, blocks[k])) << (k - first);
    }
    block_pairs[index] = bits;
}
