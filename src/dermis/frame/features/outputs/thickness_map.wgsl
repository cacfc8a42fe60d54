// Thickness of the tissue below each cell of the coarse atlas, measured to the cells on the far side with which it forms
// translucent pairs.
//#include "translucency/translucent_pair.wgsl"
//#include "each.wgsl"

struct ReceiverRange {
    cell: u32, // of the coarse atlas, x and y packed
    first: u32, // range of its pairs
    end: u32,
}

struct Reach {
    count: u32, // number of cells with pairs
    radius_mm: f32, // largest distance of a pair
    cell_mm2: f32, // squared distance between cells
}

@group(0) @binding(0) var<uniform> reach: Reach;
@group(0) @binding(1) var<storage, read> receiver_ranges: array<ReceiverRange>;
@group(0) @binding(2) var<storage, read> pairs: array<u32>; // three words: source, receiver, offset in the atlas
@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var thickness_map: texture_storage_2d<rgba32float, write>; // [mm], and 1

// Squared widths of the lateral weight: as a fraction of the squared depth, and of the area of a cell.
const CONE: f32 = 0.05;
const AREA_BLUR: f32 = 0.4;
const FAR_WEIGHT: f32 = 1e-3; // weight of the largest distance, where a wall right below has a weight of about 1
const FADE_START: f32 = 0.7; // fraction of the largest distance at which weights start to fade

// Depth of the source along the inward normal of the receiver [mm], and its weight: cells right below weigh most.
fn far_side(receiver: Receiver, source: Source) -> vec2f {
    let geometry = pair_geometry(receiver.position, receiver.normal, source);
    let depth = dot(receiver.position - source.centre, receiver.normal);
    let lateral2 = max(geometry.distance2 - depth * depth, 0.0);
    let area_mm2 = max(reach.cell_mm2, source.area); // sparse cells get a wider weight, which hides their pattern
    let lateral_weight = exp(-lateral2 / (CONE * depth * depth + AREA_BLUR * area_mm2));
    let blurred2 = lateral2 + area_mm2;
    let fade = 1.0 - smooth_ramp(FADE_START, 1.0, sqrt(geometry.distance2) / reach.radius_mm);
    let fraction = select(0.0, fade * pair_fraction(geometry.cosine, geometry.inward), depth > 0.0);
    return vec2f(depth, fraction * source.area * lateral_weight * area_mm2 * area_mm2 / (blurred2 * blurred2 * blurred2));
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= reach.count) {
        return;
    }
    let range = receiver_ranges[index];
    var total = FAR_WEIGHT;
    var sum = FAR_WEIGHT * reach.radius_mm;
    for (var k = range.first; k < range.end; k++) {
        let depth_weight = far_side(receiver_points[pairs[3u * k + 1u]], source_points[pairs[3u * k]]);
        sum += depth_weight.x * depth_weight.y;
        total += depth_weight.y;
    }
    textureStore(thickness_map, vec2u(range.cell & 0xffffu, range.cell >> 16u), vec4f(sum / total, 0.0, 0.0, 1.0));
}
