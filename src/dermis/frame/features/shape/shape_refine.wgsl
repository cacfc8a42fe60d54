// Points of a subdivided surface, each a weighted mean of control points.
//#include "each.wgsl"

struct Term {
    point: u32,
    weight: f32, // the weights of a point sum to 1
}

@group(0) @binding(0) var<storage, read> control: array<f32>; // three floats per point [mm]
@group(0) @binding(1) var<storage, read> first: array<u32>; // start of the terms of each point
@group(0) @binding(2) var<storage, read> terms: array<Term>;
@group(0) @binding(3) var<storage, read_write> points: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&first) - 1u) {
        return;
    }
    var p = vec3f(0.0);
    for (var k = first[index]; k < first[index + 1u]; k++) {
        let term = terms[k];
        let at = 3u * term.point;
        p += term.weight * vec3f(control[at], control[at + 1u], control[at + 2u]);
    }
    points[3u * index] = p.x;
    points[3u * index + 1u] = p.y;
    points[3u * index + 2u] = p.z;
}
