// List of the pairs that hits.wgsl found, and a mark for each source that is in a pair.
//#include "each.wgsl"
//#include "search.wgsl"

@group(0) @binding(3) var<storage, read> receiver_ranges: array<vec4u>; // see hits.wgsl
@group(0) @binding(4) var<storage, read> partners: array<u32>;
@group(0) @binding(5) var<storage, read> source_ranges: array<vec2u>;
@group(0) @binding(6) var<storage, read> hits: array<u32>;
@group(0) @binding(7) var<storage, read> first: array<u32>; // first pair of each receiver
@group(0) @binding(8) var<storage, read_write> pairs: array<u32>; // three words: source, receiver, unused
@group(0) @binding(9) var<storage, read_write> used: array<atomic<u32>>; // 1 for sources of a pair

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
    let range = receiver_ranges[index];
    var next = first[index];
    if (next == first[index + 1u]) {
        return;
    }
    for (var k = range.x; k < range.y; k++) {
        let begin = source_ranges[partners[k]].x;
        var bits = hits[range.z + k - range.x];
        while (bits != 0u) {
            let source = begin + firstTrailingBit(bits);
            bits &= bits - 1u;
            pairs[3u * next] = source;
            pairs[3u * next + 1u] = index;
            atomicStore(&used[source], 1u);
            next++;
        }
    }
}
