// Exitance of each patch of the skin after one more bounce.
//#include "links.wgsl"

override MEAN: bool = false; // whether incident light is the mean radiance of the patches in view, instead of the sum by form factors

@group(0) @binding(0) var<storage, read> direct_exitance: array<vec4f>; // without bounces, see interreflection_means.wgsl
@group(0) @binding(4) var<storage, read> uniform_exitance: array<vec4f>; // see interreflection_means.wgsl
@group(0) @binding(5) var<storage, read_write> bounced: array<vec4f>; // `exitance` of links.wgsl

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane) / TEAM;
    let is_patch = index < arrayLength(&bounced);
    let sum = gathered(index, is_patch, lane);
    if (is_patch && lane % TEAM == 0u) {
        let light = uniform_exitance[index].rgb * (sum.rgb / select(1.0, max(sum.a, 1e-6), MEAN));
        bounced[index] = direct_exitance[index] + vec4f(light, 0.0);
    }
}
