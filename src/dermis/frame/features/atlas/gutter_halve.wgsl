// The list of texels beyond the charts' edges at half the resolution: each has its light where its four have theirs.
//#include "each.wgsl"

//#fill const SAME_PLACE: f32 = {same_place}; // texels within which the four show one part of the surface

struct Beyond {
    source: vec2f, // where the light is [texel], whole numbers at texel centres
    texel: vec2u, // that shows it
}

struct Square {
    texel: u32, // x and y packed
    first: u32, // of its texels among the members
    end: u32,
}

@group(0) @binding(0) var<storage, read> finer: array<Beyond>;
@group(0) @binding(1) var<storage, read> squares: array<Square>;
@group(0) @binding(2) var<storage, read> members: array<u32>;
@group(0) @binding(3) var<storage, read_write> coarser: array<Beyond>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&squares)) {
        return;
    }
    let square = squares[index];
    let first = finer[members[square.first]].source;
    var sum = vec3f(0.0);
    for (var k = square.first; k < square.end; k++) {
        let source = finer[members[k]].source;
        if (all(abs(source - first) < vec2f(SAME_PLACE))) {
            sum += vec3f(source, 1.0);
        }
    }
    coarser[index] = Beyond(0.5 * sum.xy / sum.z - 0.25, vec2u(square.texel & 0xffffu, square.texel >> 16u));
}
