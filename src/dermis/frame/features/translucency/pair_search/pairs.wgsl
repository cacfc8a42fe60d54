// The pairs that hits.wgsl has found, one after the other, and which sources have any.
//#include "each.wgsl"
//#include "search.wgsl"

@group(0) @binding(3) var<storage, read> looks: array<vec4u>; // as in hits.wgsl
@group(0) @binding(4) var<storage, read> facing: array<u32>;
@group(0) @binding(5) var<storage, read> sources_of: array<vec2u>;
@group(0) @binding(6) var<storage, read> hits: array<u32>;
@group(0) @binding(7) var<storage, read> first: array<u32>; // pair of each receiver
@group(0) @binding(8) var<storage, read_write> pairs: array<u32>; // three words: source, receiver, free
@group(0) @binding(9) var<storage, read_write> used: array<atomic<u32>>; // 1 for sources with a pair

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
    let look = looks[index];
    var at = first[index];
    if (at == first[index + 1u]) {
        return;
    }
    for (var k = look.x; k < look.y; k++) {
        let begin = sources_of[facing[k]].x;
        var bits = hits[look.z + k - look.x];
        while (bits != 0u) {
            let source = begin + firstTrailingBit(bits);
            bits &= bits - 1u;
            pairs[3u * at] = source;
            pairs[3u * at + 1u] = index;
            atomicStore(&used[source], 1u);
            at++;
        }
    }
}
