// Control points moved by morph targets, then by bones.
//#include "each.wgsl"

override BONED: bool = false; // whether points follow bones

struct Influence {
    bone: vec4u,
    weight: vec4f, // they add up to 1
}

@group(0) @binding(0) var<storage, read> rest: array<f32>; // three of each point [mm]
@group(0) @binding(1) var<storage, read> weights: array<f32>; // of the targets
@group(0) @binding(2) var<storage, read> matrices: array<vec4f>; // three rows of each bone, from rest to pose
@group(0) @binding(3) var<storage, read> first: array<u32>; // where a point's displacements begin
@group(0) @binding(4) var<storage, read> displacements: array<vec4f>; // at weight 1 [mm], and the target's number
@group(0) @binding(5) var<storage, read> influences: array<Influence>;
@group(0) @binding(6) var<storage, read_write> posed: array<f32>;

fn moved_by(bone: u32, p: vec4f) -> vec3f {
    let row = 3u * bone;
    return vec3f(dot(matrices[row], p), dot(matrices[row + 1u], p), dot(matrices[row + 2u], p));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&first) - 1u) {
        return;
    }
    var p = vec3f(rest[3u * index], rest[3u * index + 1u], rest[3u * index + 2u]);
    for (var k = first[index]; k < first[index + 1u]; k++) {
        let by = displacements[k];
        p += weights[bitcast<u32>(by.w)] * by.xyz;
    }
    if (BONED) {
        let influence = influences[index];
        let at = vec4f(p, 1.0);
        p = vec3f(0.0);
        for (var k = 0u; k < 4u; k++) {
            if (influence.weight[k] > 0.0) {
                p += influence.weight[k] * moved_by(influence.bone[k], at);
            }
        }
    }
    posed[3u * index] = p.x;
    posed[3u * index + 1u] = p.y;
    posed[3u * index + 2u] = p.z;
}
