// List of gutter texels at half the resolution: the source of each is the mean of the sources of the (up to four) finer gutter
// texels in it.
//#include "each.wgsl"

//#fill const SAME_SOURCE: f32 = {same_source}; // distance from the first source within which the others are averaged [texels]

struct GutterTexel {
    source: vec2f, // position whose light is copied [texels]; integers are texel centres
    texel: vec2u,
}

struct Square {
    texel: u32, // x and y packed
    first: u32, // range of its finer texels in `members`
    end: u32,
}

@group(0) @binding(0) var<storage, read> finer: array<GutterTexel>;
@group(0) @binding(1) var<storage, read> squares: array<Square>;
@group(0) @binding(2) var<storage, read> members: array<u32>;
@group(0) @binding(3) var<storage, read_write> coarser: array<GutterTexel>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&squares)) {
        return;
    }
    let square = squares[index];
    let first = finer[members[square.first]].source;
    var sum = vec3f(0.0);
    for (var k = square.first; k < square.end; k++) {
        let source = finer[members[k]].source;
        if (all(abs(source - first) < vec2f(SAME_SOURCE))) {
            sum += vec3f(source, 1.0);
        }
    }
    coarser[index] = GutterTexel(0.5 * sum.xy / sum.z - 0.25, vec2u(square.texel & 0xffffu, square.texel >> 16u));
}
