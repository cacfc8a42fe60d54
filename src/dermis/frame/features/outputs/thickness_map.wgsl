// How thick the flesh is below each cell of the coarse atlas, from the cells that its translucent pairs find on the far side.
//#include "translucency/translucent_pair.wgsl"
//#include "each.wgsl"

struct Listed {
    cell: u32, // of the coarse atlas, x and y packed
    first: u32, // pair
    end: u32, // of its pairs
}

struct Reach {
    count: u32, // of cells with pairs
    radius_mm: f32, // largest distance of a pair
    spacing2_mm2: f32, // square of the distance between cells
}

@group(0) @binding(0) var<uniform> reach: Reach;
@group(0) @binding(1) var<storage, read> listed: array<Listed>;
@group(0) @binding(2) var<storage, read> pairs: array<u32>; // three words: source, receiver, offset in the map
@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var thickness_map: texture_storage_2d<rgba32float, write>; // [mm], and 1

// Squares of how far places beside the inward normal count: of a part of their depth, and of a part of the spacing.
const CONE: f32 = 0.05;
const GRAIN: f32 = 0.4;
const BEYOND: f32 = 1e-3; // how much what lies deeper than pairs reach counts, where a wall below counts about 1
const FADES: f32 = 0.7; // of the radius, from which places count less and less

// Depth along the inward normal of the far side, and how much it counts: cells right below count most.
fn far_side(receiver: Receiver, source: Source) -> vec2f {
    let lie = lie_of(receiver.position, receiver.normal, source);
    let depth = dot(receiver.position - source.centre, receiver.normal);
    let aside2 = max(lie.square - depth * depth, 0.0);
    let grain = max(reach.spacing2_mm2, source.area); // sparse cells are blurred more, which hides their pattern
    let near = exp(-aside2 / (CONE * depth * depth + GRAIN * grain));
    let even = aside2 + grain;
    let within = 1.0 - rise(FADES, 1.0, sqrt(lie.square) / reach.radius_mm);
    let share = select(0.0, within * share_of(lie.cosine, lie.inward), depth > 0.0);
    return vec2f(depth, share * source.area * near * grain * grain / (even * even * even));
}

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
    let one = listed[index];
    var total = BEYOND;
    var sum = BEYOND * reach.radius_mm;
    for (var k = one.first; k < one.end; k++) {
        let found = far_side(receiver_points[pairs[3u * k + 1u]], source_points[pairs[3u * k]]);
        sum += found.x * found.y;
        total += found.y;
    }
    textureStore(thickness_map, vec2u(one.cell & 0xffffu, one.cell >> 16u), vec4f(sum / total, 0.0, 0.0, 1.0));
}
