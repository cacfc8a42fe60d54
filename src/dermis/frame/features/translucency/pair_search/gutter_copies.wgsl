// Where gutters show each source: the middle of each patch of texels that copy its texel or one beside it.
//#include "translucency/translucent_pair.wgsl"
//#include "map_positions.wgsl"
//#include "each.wgsl"
//#include "search.wgsl"

@group(0) @binding(3) var<storage, read> source_points: array<Source>;
@group(0) @binding(4) var<storage, read> rows: array<vec2u>; // first and end of the texels that show three rows of cells
@group(0) @binding(5) var<storage, read> gutters: array<vec2u>; // texel, and the texel that it shows
@group(0) @binding(6) var<storage, read> asked: array<u32>; // sources
@group(0) @binding(7) var<storage, read_write> copies: array<u32>; // places, COPIES of each that is asked for [1/8 texel]

const APART: i32 = 4; // texels between the middles of two patches

var<private> sums: array<vec2i, COPIES>;
var<private> counts: array<i32, COPIES>;

// To the first patch that is near, or else in the place of the smallest one: slivers show a source in many places.
fn add(place: vec2i) {
    var near = COPIES;
    var smallest = 0u;
    for (var k = COPIES; k > 0u; k--) {
        let far = abs(sums[k - 1u] - counts[k - 1u] * place);
        if (counts[k - 1u] > 0 && max(far.x, far.y) <= APART * counts[k - 1u]) {
            near = k - 1u;
        }
        if (counts[k - 1u] <= counts[smallest]) {
            smallest = k - 1u;
        }
    }
    if (near < COPIES) {
        sums[near] += place;
        counts[near]++;
    } else {
        sums[smallest] = place;
        counts[smallest] = 1;
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
    let texel = unpacked(source_points[asked[index]].texel);
    for (var row = 0u; row < 3u; row++) {
        let listed = rows[3u * index + row];
        for (var k = listed.x; k < listed.y; k++) {
            let away = abs(unpacked(gutters[k].y) - texel);
            if (max(away.x, away.y) <= 1) {
                add(unpacked(gutters[k].x));
            }
        }
    }
    for (var k = 0u; k < COPIES; k++) {
        let place = FINE * sums[k] / max(counts[k], 1);
        copies[COPIES * index + k] = select(NOWHERE, u32(place.x) | (u32(place.y) << 16u), counts[k] > 0);
    }
}
