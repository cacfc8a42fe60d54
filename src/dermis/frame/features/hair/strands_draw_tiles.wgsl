// Draws strands over the picture; each workgroup draws the segments of one tile.
//#include "strand_team.wgsl"
//#include "strand_labels.wgsl"

@group(0) @binding(34) var behind: texture_2d<f32>; // radiance and coverage
@group(0) @binding(35) var image: texture_storage_2d<rgba32float, write>;

var<private> depths: Depths;

fn begin_pixel(pixel: vec2u) -> f32 {
    clear_fragments();
    depths = Depths(vec4f(-1.0), vec4f(-1.0), 1.0);
    if (all(pixel < textureDimensions(image))) {
        depths = depths_at(pixel);
        begin_labels(pixel);
    }
    let farther = max(depths.first, depths.second);
    return max(max(farther.x, farther.y), max(farther.z, farther.w));
}

fn visit_segment(fragment: Fragment) {
    label_fragment(fragment);
    var one = fragment;
    one.cover *= visible_fraction(one.depth, depths);
    if (one.cover > 0.0) {
        add_fragment(one);
    }
}

// Sums of a pixel by one layer, to be merged by the first layer.
struct PartialSums {
    cover_sums: array<u32, 2>,
    light: array<u32, 3>,
}

var<workgroup> partial_nearest: array<array<Fragment, MAX_FRAGMENTS>, LANES>;
var<workgroup> partial_sums: array<PartialSums, LANES>;

fn store_partial(lane: u32) {
    partial_nearest[lane] = nearest;
    partial_sums[lane] = PartialSums(array<u32, 2>(cover_sums.x, cover_sums.y), array<u32, 3>(light.x, light.y, light.z));
    store_partial_labels(lane);
}

fn merge_partial(lane: u32) {
    for (var k = 0u; k < MAX_FRAGMENTS; k += 1u) {
        let one = partial_nearest[lane][k];
        if (one.cover > 0.0) {
            add_fragment(one);
        }
    }
    let sums = partial_sums[lane];
    cover_sums += vec2u(sums.cover_sums[0], sums.cover_sums[1]);
    light += vec3u(sums.light[0], sums.light[1], sums.light[2]);
    merge_partial_labels(lane);
}

@compute @workgroup_size(TEAM_TILE, TEAM_TILE, LAYERS)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let layer = index / LANES;
    let lane = index % LANES;
    let covered = visit_segments(id.xy, tile.xy, lane, layer);
    for (var other = 1u; covered && other < LAYERS; other += 1u) {
        workgroupBarrier();
        if (layer == other) {
            store_partial(lane);
        }
        workgroupBarrier();
        if (layer == 0u) {
            merge_partial(lane);
        }
    }
    if (layer > 0u || any(id.xy >= textureDimensions(image))) {
        return;
    }
    store_label(id.xy);
    let radiance = textureLoad(behind, id.xy, 0);
    if (covered) {
        textureStore(image, id.xy, composite(radiance));
    } else {
        textureStore(image, id.xy, radiance);
    }
}
