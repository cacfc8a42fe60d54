// Where in the map each receiver finds the light of its sources: the nearest place that blurs reach, in the chart or its gutter.
//#include "translucency/translucent_pair.wgsl"
//#include "map_positions.wgsl"
//#include "atlas/reach.wgsl"
//#include "each.wgsl"
//#include "search.wgsl"

@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var<storage, read> copies: array<u32>; // of sources with pairs, as gutter_copies.wgsl has them
@group(0) @binding(7) var<storage, read> number_of_source: array<u32>; // among those with pairs
@group(0) @binding(8) var<storage, read> number_of_receiver: array<u32>;
@group(0) @binding(9) var<storage, read_write> pairs: array<u32>; // three words: source, receiver, offset [1/8 texel]
@group(0) @binding(10) var reach_map: texture_2d<u32>;

const MOST: i32 = 32767; // of them

var<private> texel: vec2i; // the receiver's
var<private> metric: vec3f; // there: squares along u and v, and the product [mm^2]
var<private> rows: vec2i; // that blurs reach up and down
var<private> nearest: f32;
var<private> offset: u32;

// Whether blurs bring light from a row of texels around a place.
fn reaches(by: vec2i) -> bool {
    let columns = vec2i(reach_along(textureLoad(reach_map, texel + vec2i(0, by.y), 0), 0u));
    return by.y >= -rows.x && by.y <= rows.y && by.x >= -columns.x && by.x <= columns.y;
}

// At a place or beside it: what is read there is smooth.
fn try_place(place: vec2i) {
    let fine = place - FINE * texel;
    let by = (place + FINE / 2) / FINE - texel;
    let far = dot(metric, vec3f(vec3i(fine * fine, 2 * fine.x * fine.y)));
    let reached = reaches(by);
    if (reached && far < nearest && all(abs(fine) <= vec2i(MOST))) {
        nearest = far;
        offset = (u32(fine.x) & 0xffffu) | (u32(fine.y) << 16u);
    }
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= search.count) {
        return;
    }
    let source = pairs[3u * index];
    let receiver = pairs[3u * index + 1u];
    texel = unpacked(receiver_points[receiver].texel);
    metric = receiver_points[receiver].metric;
    rows = vec2i(reach_along(textureLoad(reach_map, texel, 0), 1u));
    nearest = 1e30;
    offset = NOWHERE;
    try_place(FINE * unpacked(source_points[source].texel));
    let number = number_of_source[source];
    for (var k = COPIES * number; k < COPIES * (number + 1u) && copies[k] != NOWHERE; k++) {
        try_place(unpacked(copies[k]));
    }
    pairs[3u * index] = number;
    pairs[3u * index + 1u] = number_of_receiver[receiver];
    pairs[3u * index + 2u] = offset;
}
