// Light that leaves each patch of the skin after one more bounce; after none, the mean of its places.
//#include "each.wgsl"
//#include "links.wgsl"

override BOUNCES: bool = false; // whether patches already have light
override MEAN: bool = false; // whether places know how much they see of other skin, so that its mean is wanted

//#fill const SAMPLES: u32 = {linked_samples}u; // places of a patch

@group(0) @binding(0) var<storage, read> emitted: array<vec4f>; // as interreflection_places.wgsl has them
@group(0) @binding(4) var<storage, read_write> after: array<vec4f>; // as links.wgsl reads it

fn mean_of(index: u32, part: u32) -> vec4f {
    var sum = vec4f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        sum += emitted[2u * (index * SAMPLES + k) + part];
    }
    return sum / f32(SAMPLES);
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&after)) {
        return;
    }
    let more = mean_of(index, 1u);
    var light = mean_of(index, 0u).rgb;
    if (BOUNCES) {
        let sum = gathered(index);
        light += more.rgb * (sum.rgb / select(1.0, max(sum.a, 1e-6), MEAN));
    }
    after[index] = vec4f(light, more.a);
}
