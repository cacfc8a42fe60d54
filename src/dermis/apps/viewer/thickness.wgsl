// Least depth of the flesh between each cell that takes light through it and those that give light.
//#include "translucency/translucent_pair.wgsl"
//#include "each.wgsl"

struct Sum {
    cell: u32, // of the coarse atlas, x and y packed
    first: u32, // pair
    end: u32, // of its pairs
}

struct Reach {
    radius_mm: f32, // pairs are nearer
    count: u32, // of sums
}

@group(0) @binding(0) var<uniform> reach: Reach;
@group(0) @binding(1) var<storage, read> sums: array<Sum>;
@group(0) @binding(2) var<storage, read> pairs: array<u32>; // three words: source, receiver, offset in the map
@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var thickness: texture_storage_2d<r32float, write>; // [mm]

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= reach.count) {
        return;
    }
    let sum = sums[index];
    var least = reach.radius_mm;
    for (var k = sum.first; k < sum.end; k++) {
        let receiver = receiver_points[pairs[3u * k + 1u]];
        let lie = lie_of(receiver.position, receiver.normal, source_points[pairs[3u * k]]);
        let counts = share_of(lie.cosine, lie.inward) > 0.0 && lie.square < reach.radius_mm * reach.radius_mm;
        least = select(least, min(least, lie.depth), counts);
    }
    textureStore(thickness, vec2u(sum.cell & 0xffffu, sum.cell >> 16u), vec4f(least, 0.0, 0.0, 0.0));
}
