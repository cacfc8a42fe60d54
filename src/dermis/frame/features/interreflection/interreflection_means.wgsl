// Exitance of each patch of the skin: the mean of its sample points.
//#include "team.wgsl"

//#fill const SAMPLES: u32 = {linked_samples}u; // samples of a patch

@group(0) @binding(0) var<storage, read> sample_exitance: array<vec4f>; // see interreflection_points.wgsl
@group(0) @binding(1) var<storage, read_write> direct_exitance: array<vec4f>; // exitance, and the fraction of uniform light that enters the skin
@group(0) @binding(2) var<storage, read_write> uniform_exitance: array<vec4f>; // exitance in uniform irradiance 1

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane) / TEAM;
    let samples = select(0u, SAMPLES, index < arrayLength(&direct_exitance));
    var direct = vec4f(0.0);
    var uniform_light = vec4f(0.0);
    for (var k = lane % TEAM; k < samples; k += TEAM) {
        direct += sample_exitance[2u * (index * SAMPLES + k)];
        uniform_light += sample_exitance[2u * (index * SAMPLES + k) + 1u];
    }
    direct = team_sum(direct, lane) / f32(SAMPLES);
    uniform_light = team_sum(uniform_light, lane) / f32(SAMPLES);
    if (lane % TEAM == 0u && samples > 0u) {
        direct_exitance[index] = vec4f(direct.rgb, uniform_light.a);
        uniform_exitance[index] = vec4f(uniform_light.rgb, 0.0);
    }
}
