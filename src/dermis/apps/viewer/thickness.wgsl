// Least tissue thickness between each cell that receives transmitted light and its source cells.
//#include "translucency/translucent_pair.wgsl"
//#include "each.wgsl"

struct ReceiverRange {
    cell: u32, // receiving cell of the coarse atlas, x and y packed
    first: u32, // first pair of the cell
    end: u32, // one past its last pair
}

struct ThicknessParameters {
    radius_mm: f32, // maximum distance of a pair
    count: u32, // number of receiver ranges
}

@group(0) @binding(0) var<uniform> parameters: ThicknessParameters;
@group(0) @binding(1) var<storage, read> receiver_ranges: array<ReceiverRange>;
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
    let index = list_index(group, groups, lane);
    if (index >= parameters.count) {
        return;
    }
    let range = receiver_ranges[index];
    var thickness_mm = parameters.radius_mm;
    for (var k = range.first; k < range.end; k++) {
        let receiver = receiver_points[pairs[3u * k + 1u]];
        let geometry = pair_geometry(receiver.position, receiver.normal, source_points[pairs[3u * k]]);
        let is_near = geometry.distance2 < parameters.radius_mm * parameters.radius_mm;
        let is_connected = pair_fraction(geometry.cosine, geometry.inward) > 0.0 && is_near;
        thickness_mm = select(thickness_mm, min(thickness_mm, geometry.depth), is_connected);
    }
    textureStore(thickness, vec2u(range.cell & 0xffffu, range.cell >> 16u), vec4f(thickness_mm, 0.0, 0.0, 0.0));
}
