// One smoothing step of the curvature: the mean over each point and its neighbours.
//#include "each.wgsl"

@group(0) @binding(0) var<storage, read> around: array<vec4u>; // ranges of the triangles and of the neighbours of each vertex
@group(0) @binding(1) var<storage, read> neighbours: array<u32>; // one vertex of each neighbouring point
@group(0) @binding(2) var<storage, read> before: array<f32>;
@group(0) @binding(3) var<storage, read_write> curvatures: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&around)) {
        return;
    }
    let here = around[index];
    var sum = before[index];
    for (var k = here.z; k < here.w; k++) {
        sum += before[neighbours[k]];
    }
    curvatures[index] = sum / f32(1u + here.w - here.z);
}
