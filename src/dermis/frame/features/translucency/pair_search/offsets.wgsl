// Offset in the atlas from the receiver to the source of each pair. The source may appear at its texel and again in gutters;
// the offset is to the nearest of these positions from which blurs carry light to the receiver.
//#include "translucency/translucent_pair.wgsl"
//#include "map_positions.wgsl"
//#include "atlas/reach.wgsl"
//#include "each.wgsl"
//#include "search.wgsl"

@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var<storage, read> copies: array<u32>; // of sources with pairs, see gutter_copies.wgsl
@group(0) @binding(7) var<storage, read> source_index: array<u32>; // index among the sources with pairs
@group(0) @binding(8) var<storage, read> receiver_index: array<u32>;
@group(0) @binding(9) var<storage, read_write> pairs: array<u32>; // three words: source, receiver, offset [1/8 texel]
@group(0) @binding(10) var reach_map: texture_2d<u32>;

const MAX_OFFSET: i32 = 32767; // largest offset that fits

var<private> texel: vec2i; // of the receiver
var<private> metric: vec3f; // first fundamental form there: E, G and F [mm^2]
var<private> rows: vec2i; // rows that blurs reach up and down
var<private> nearest2: f32;
var<private> offset: u32;

// Whether blurs carry light from an offset to the receiver.
fn is_reachable(offset_texels: vec2i) -> bool {
    let columns = vec2i(reach_along(textureLoad(reach_map, texel + vec2i(0, offset_texels.y), 0), 0u));
    return offset_texels.y >= -rows.x && offset_texels.y <= rows.y && offset_texels.x >= -columns.x && offset_texels.x <= columns.y;
}

// Takes the position, rounded to a texel for the test of reach, if it is the nearest one yet.
fn try_position(position: vec2i) {
    let offset_fine = position - FINE * texel;
    let offset_texels = (position + FINE / 2) / FINE - texel;
    let distance2 = dot(metric, vec3f(vec3i(offset_fine * offset_fine, 2 * offset_fine.x * offset_fine.y)));
    let reachable = is_reachable(offset_texels);
    if (reachable && distance2 < nearest2 && all(abs(offset_fine) <= vec2i(MAX_OFFSET))) {
        nearest2 = distance2;
        offset = (u32(offset_fine.x) & 0xffffu) | (u32(offset_fine.y) << 16u);
    }
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= search.count) {
        return;
    }
    let source = pairs[3u * index];
    let receiver = pairs[3u * index + 1u];
    texel = unpacked(receiver_points[receiver].texel);
    metric = receiver_points[receiver].metric;
    rows = vec2i(reach_along(textureLoad(reach_map, texel, 0), 1u));
    nearest2 = 1e30;
    offset = NO_OFFSET;
    try_position(FINE * unpacked(source_points[source].texel));
    let renumbered = source_index[source];
    for (var k = COPIES * renumbered; k < COPIES * (renumbered + 1u) && copies[k] != NO_OFFSET; k++) {
        try_position(unpacked(copies[k]));
    }
    pairs[3u * index] = renumbered;
    pairs[3u * index + 1u] = receiver_index[receiver];
    pairs[3u * index + 2u] = offset;
}
