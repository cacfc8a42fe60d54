// How the map lies on the surface beyond the edges of charts: as it does at the nearest place on the edge.
//#include "stretch_of.wgsl"
//#include "each.wgsl"

struct Rooted {
    texel: u32, // x and y packed
    triangle: u32, // of the nearest place on the edge, and its barycentric weights packed
    weights: u32,
}

@group(0) @binding(31) var<storage, read> rooted: array<Rooted>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&rooted)) {
        return;
    }
    let one = rooted[index];
    let w = unpack2x16unorm(one.weights);
    put_stretch(vec2u(one.texel & 0xffffu, one.texel >> 16u), stretch_of(one.triangle, vec3f(1.0 - w.x - w.y, w)));
}
