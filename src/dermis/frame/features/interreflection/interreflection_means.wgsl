// What leaves a patch of the skin: the mean of its places.
//#include "team.wgsl"

//#fill const SAMPLES: u32 = {linked_samples}u; // places of a patch

@group(0) @binding(0) var<storage, read> emitted: array<vec4f>; // as interreflection_points.wgsl has them
@group(0) @binding(1) var<storage, read_write> leaving: array<vec4f>; // light, and the share of light from everywhere that enters
@group(0) @binding(2) var<storage, read_write> around: array<vec4f>; // light that leaves where 1 arrives from everywhere

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane) / TEAM;
    let places = select(0u, SAMPLES, index < arrayLength(&leaving));
    var light = vec4f(0.0);
    var more = vec4f(0.0);
    for (var k = lane % TEAM; k < places; k += TEAM) {
        light += emitted[2u * (index * SAMPLES + k)];
        more += emitted[2u * (index * SAMPLES + k) + 1u];
    }
    light = of_team(light, lane) / f32(SAMPLES);
    more = of_team(more, lane) / f32(SAMPLES);
    if (lane % TEAM == 0u && places > 0u) {
        leaving[index] = vec4f(light.rgb, more.a);
        around[index] = vec4f(more.rgb, 0.0);
    }
}
