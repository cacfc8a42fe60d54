// Light through thin parts, summed at each receiver by a team of invocations.
//#include "packed_light.wgsl"
//#include "packed_pair.wgsl"

override SIZE: u32 = 128u; // invocations of a workgroup
override TEAM: u32 = 32u; // invocations per receiver: a power of two up to SIZE
override ROUND: u32 = 4u; // pairs that an invocation loads at once: 1, 2 or 4

struct Receiver {
    cell: u32, // of the coarse atlas, x and y packed
    first: u32, // range of its pairs
    end: u32,
}

@group(0) @binding(0) var<storage, read> receivers: array<Receiver>; // those with most pairs first
@group(0) @binding(1) var<storage, read> weights: array<vec2u>; // packed source and directionality, encoded weight; see translucency_weights.wgsl
@group(0) @binding(2) var<storage, read> source_light: array<vec4u>; // packed light, and packed light times its direction factor
@group(0) @binding(3) var transmitted: texture_storage_2d<rgba32float, write>;

var<workgroup> partial_sum: array<vec3f, SIZE>;

// Three weights with a common exponent.
fn decoded(word: u32) -> vec3f {
    let unit = bitcast<f32>(((word >> 27u) + 103u) << 23u); // 2^(exponent - 24)
    return unit * vec3f(f32(word & 511u), f32((word >> 9u) & 511u), f32((word >> 18u) & 511u));
}

fn transmitted_light(k: u32, end: u32) -> vec3f {
    let pair = weights[min(k, end - 1u)];
    let source = source_light[pair.x & SOURCE_MASK];
    let light = unpack_light(source.xy);
    let directionality = f32(bitcast<i32>(pair.x) >> SOURCE_BITS) / DIRECTIONALITY_SCALE;
    return select(0.0, 1.0, k < end) * decoded(pair.y) * max(light + directionality * (unpack_light(source.zw) - light), vec3f(0.0));
}

// Sum over ROUND pairs, loaded together to hide the latency of memory.
fn transmitted_round(k: u32, end: u32) -> vec3f {
    var sum = transmitted_light(k, end);
    if (ROUND > 1u) {
        sum += transmitted_light(k + TEAM, end);
    }
    if (ROUND > 2u) {
        sum += transmitted_light(k + 2u * TEAM, end) + transmitted_light(k + 3u * TEAM, end);
    }
    return sum;
}

@compute @workgroup_size(SIZE)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = (group.y * groups.x + group.x) * (SIZE / TEAM) + lane / TEAM;
    let member = lane % TEAM;
    var receiver = Receiver();
    if (index < arrayLength(&receivers)) {
        receiver = receivers[index];
    }
    var sum = vec3f(0.0);
    for (var k = receiver.first + member; k < receiver.end; k += ROUND * TEAM) {
        sum += transmitted_round(k, receiver.end);
    }
    if (TEAM > 1u) {
        partial_sum[lane] = sum;
        for (var stride = TEAM / 2u; stride > 0u; stride /= 2u) {
            workgroupBarrier();
            if (member < stride) {
                partial_sum[lane] += partial_sum[lane + stride];
            }
        }
        sum = partial_sum[lane];
    }
    if (member == 0u && receiver.end > 0u) {
        textureStore(transmitted, vec2u(receiver.cell & 0xffffu, receiver.cell >> 16u), vec4f(sum, 1.0));
    }
}
