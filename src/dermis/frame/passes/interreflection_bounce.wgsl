// Light that leaves each patch of the skin after one more bounce; after none, the mean of its places.
//#include "each.wgsl"

override BOUNCES: bool = false; // whether patches already have light
override MEAN: bool = false; // whether places know how much they see of other skin, so that its mean is wanted

//#fill const SAMPLES: u32 = {linked_samples}u; // places of a patch

@group(0) @binding(0) var<storage, read> emitted: array<vec4f>; // as interreflection_places.wgsl has them
@group(0) @binding(1) var<storage, read> first: array<u32>; // where the links of each patch begin
@group(0) @binding(2) var<storage, read> links: array<vec2u>; // patch, form factor
@group(0) @binding(3) var<storage, read> before: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> after: array<vec4f>; // light, and the share of light from everywhere that enters

fn mean_of(index: u32, part: u32) -> vec4f {
    var sum = vec4f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        sum += emitted[2u * (index * SAMPLES + k) + part];
    }
    return sum / f32(SAMPLES);
}

fn gathered(index: u32) -> vec3f {
    var sum = vec4f(0.0);
    let end = min(first[index + 1u], arrayLength(&links));
    for (var k = first[index]; k < end; k++) {
        let link = links[k];
        sum += bitcast<f32>(link.y) * vec4f(before[link.x].rgb, 1.0);
    }
    return sum.rgb / select(1.0, max(sum.a, 1e-6), MEAN);
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
        light += more.rgb * gathered(index);
    }
    after[index] = vec4f(light, more.a);
}
