// Light that leaves each patch of the skin after one more bounce.
//#include "links.wgsl"

override MEAN: bool = false; // whether places know how much they see of other skin, so that its mean is wanted

@group(0) @binding(0) var<storage, read> leaving: array<vec4f>; // without bounces, as interreflection_means.wgsl has it
@group(0) @binding(4) var<storage, read> around: array<vec4f>; // as interreflection_means.wgsl has it
@group(0) @binding(5) var<storage, read_write> after: array<vec4f>; // as links.wgsl reads it

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane) / TEAM;
    let here = index < arrayLength(&after);
    let sum = gathered(index, here, lane);
    if (here && lane % TEAM == 0u) {
        let light = around[index].rgb * (sum.rgb / select(1.0, max(sum.a, 1e-6), MEAN));
        after[index] = leaving[index] + vec4f(light, 0.0);
    }
}
