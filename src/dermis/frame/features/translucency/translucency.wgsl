// Light that comes through thin parts, summed where it leaves: a team of invocations for each receiver.
//#include "packed_light.wgsl"
//#include "packed_pair.wgsl"

override SIZE: u32 = 128u; // invocations of a workgroup
override TEAM: u32 = 32u; // invocations of a receiver: a power of two up to SIZE
override ROUND: u32 = 4u; // pairs that an invocation loads at once: 1, 2 or 4

struct Receiver {
    cell: u32, // of the coarse atlas, x and y packed
    first: u32, // pair
    end: u32, // of its pairs
}

@group(0) @binding(0) var<storage, read> receivers: array<Receiver>; // those with most pairs first
@group(0) @binding(1) var<storage, read> weights: array<vec2u>; // source and depth, and the share of its light, as in translucency_weights.wgsl
@group(0) @binding(2) var<storage, read> gathered: array<vec4u>; // light, and what passes deep slabs of it, as in packed_light.wgsl
@group(0) @binding(3) var transmitted: texture_storage_2d<rgba32float, write>;

var<workgroup> part: array<vec3f, SIZE>;

// Three shares with one exponent.
fn decoded(word: u32) -> vec3f {
    let unit = bitcast<f32>(((word >> 27u) + 103u) << 23u); // 2^(exponent - 24)
    return unit * vec3f(f32(word & 511u), f32((word >> 9u) & 511u), f32((word >> 18u) & 511u));
}

fn passed(k: u32, end: u32) -> vec3f {
    let pair = weights[min(k, end - 1u)];
    let source = gathered[pair.x & SOURCE];
    let light = light_of(source.xy);
    let deep = f32(bitcast<i32>(pair.x) >> SOURCE_BITS) / DEEPEST;
    return select(0.0, 1.0, k < end) * decoded(pair.y) * max(light + deep * (light_of(source.zw) - light), vec3f(0.0));
}

// Several pairs at once, to hide the latency of memory.
fn passed_together(k: u32, end: u32) -> vec3f {
    var sum = passed(k, end);
    if (ROUND > 1u) {
        sum += passed(k + TEAM, end);
    }
    if (ROUND > 2u) {
        sum += passed(k + 2u * TEAM, end) + passed(k + 3u * TEAM, end);
    }
    return sum;
}

@compute @workgroup_size(SIZE)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let which = (group.y * groups.x + group.x) * (SIZE / TEAM) + number / TEAM;
    let member = number % TEAM;
    var receiver = Receiver();
    if (which < arrayLength(&receivers)) {
        receiver = receivers[which];
    }
    var sum = vec3f(0.0);
    for (var k = receiver.first + member; k < receiver.end; k += ROUND * TEAM) {
        sum += passed_together(k, receiver.end);
    }
    if (TEAM > 1u) {
        part[number] = sum;
        for (var apart = TEAM / 2u; apart > 0u; apart /= 2u) {
            workgroupBarrier();
            if (member < apart) {
                part[number] += part[number + apart];
            }
        }
        sum = part[number];
    }
    if (member == 0u && receiver.end > 0u) {
        textureStore(transmitted, vec2u(receiver.cell & 0xffffu, receiver.cell >> 16u), vec4f(sum, 1.0));
    }
}
