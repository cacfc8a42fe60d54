// Positions in gutters where each source appears: the mean position of each cluster of gutter texels that copy the texel of
// the source or a neighbour of this texel.
//#include "translucency/translucent_pair.wgsl"
//#include "map_positions.wgsl"
//#include "each.wgsl"
//#include "search.wgsl"

@group(0) @binding(3) var<storage, read> source_points: array<Source>;
@group(0) @binding(4) var<storage, read> rows: array<vec2u>; // ranges of `gutters` that show the three rows of cells around the source
@group(0) @binding(5) var<storage, read> gutters: array<vec2u>; // gutter texel, and the texel that it copies
@group(0) @binding(6) var<storage, read> queries: array<u32>; // indices of sources
@group(0) @binding(7) var<storage, read_write> copies: array<u32>; // COPIES packed positions for each query [1/8 texel]

const CLUSTER_RADIUS: i32 = 4; // texels within which a position belongs to a cluster

var<private> sums: array<vec2i, COPIES>;
var<private> counts: array<i32, COPIES>;

// Adds a position to the first cluster nearby, or else replaces the smallest cluster: slivers copy a source to many positions.
fn add_position(position: vec2i) {
    var cluster = COPIES;
    var smallest = 0u;
    for (var k = COPIES; k > 0u; k--) {
        let delta = abs(sums[k - 1u] - counts[k - 1u] * position);
        if (counts[k - 1u] > 0 && max(delta.x, delta.y) <= CLUSTER_RADIUS * counts[k - 1u]) {
            cluster = k - 1u;
        }
        if (counts[k - 1u] <= counts[smallest]) {
            smallest = k - 1u;
        }
    }
    if (cluster < COPIES) {
        sums[cluster] += position;
        counts[cluster]++;
    } else {
        sums[smallest] = position;
        counts[smallest] = 1;
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
    let texel = unpacked(source_points[queries[index]].texel);
    for (var row = 0u; row < 3u; row++) {
        let range = rows[3u * index + row];
        for (var k = range.x; k < range.y; k++) {
            let offset = abs(unpacked(gutters[k].y) - texel);
            if (max(offset.x, offset.y) <= 1) {
                add_position(unpacked(gutters[k].x));
            }
        }
    }
    for (var k = 0u; k < COPIES; k++) {
        let position = FINE * sums[k] / max(counts[k], 1);
        copies[COPIES * index + k] = select(NO_OFFSET, u32(position.x) | (u32(position.y) << 16u), counts[k] > 0);
    }
}
