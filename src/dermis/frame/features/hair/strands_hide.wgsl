// Projects all knots, and marks the segments of coarse strands that other hair or the head hides. Hair is tested by the deep opacity
// map of the picture.
//#include "each.wgsl"
//#include "strand_knots.wgsl"
//#include "view_map.wgsl"

const HIDING_COVER: f32 = 9.0; // cover by other hair that hides a strand: it transmits exp(-9) of the light
const TEST_STEP: f32 = 2.0; // largest distance between tested points of a segment [texel]
const MAX_TESTS: u32 = 16u; // parts of a segment whose ends are tested; longer segments are not hidden
const HEAD_MM: f32 = 85.0; // radius of a head
const HORIZON_MARGIN: f32 = 0.15; // margin of the test whether the head hides a strand, as a cosine

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> projected: array<ProjectedKnot>;
@group(0) @binding(32) var<storage, read> view_map: array<u32>; // see view_map.wgsl

// Cover by the layers of hair that are all in front of a depth, in a texel of the map.
fn cover_in_view(texel: vec2i, depth: f32) -> f32 {
    let word = view_map_word(clamp(texel, vec2i(0), view_map_size() - 1));
    let nearest = view_map[word];
    if (nearest == NO_HAIR) {
        return 0.0;
    }
    let before = layer_at(depth - f32(nearest) / DEPTH_SCALE);
    var sum = 0.0;
    for (var k = 0u; k < HAIR_LAYERS; k += 1u) {
        sum += select(0.0, f32(view_map[word + 1u + k]), f32(k + 1u) <= before);
    }
    return sum / COVER_SCALE;
}

// Whether other hair hides a point in all texels around it.
fn is_covered(position: vec2f, depth: f32) -> bool {
    let corner = vec2i(floor(position / VIEW_TEXEL - 0.5));
    for (var k = 0; k < 4; k += 1) {
        if (cover_in_view(corner + vec2i(k & 1, k >> 1u), depth) < HIDING_COVER) {
            return false;
        }
    }
    return true;
}

fn is_segment_covered(a: ProjectedKnot, b: ProjectedKnot) -> bool {
    let count = u32(ceil(distance(a.position, b.position) / (TEST_STEP * VIEW_TEXEL))) + 1u;
    if (count > MAX_TESTS || min(a.width, b.width) < 0.0 || max(a.width, b.width) > VIEW_TEXEL) {
        return false;
    }
    for (var k = 0u; k <= count; k += 1u) {
        let t = f32(k) / f32(count);
        if (!is_covered(mix(a.position, b.position, t), mix(a.depth, b.depth, t))) {
            return false;
        }
    }
    return true;
}

// Whether the head hides all of a coarse strand: its root lies beyond the horizon by more than its length.
fn is_behind_head(row: u32) -> bool {
    let root = posed[row + ROWS_BEFORE].xyz;
    let reach = distance(posed[row + ROWS_BEFORE + hairs.coarse_knots - 1u].xyz, root);
    return dot(posed[row].xyz, normalize(strand_view.eye - root)) < -(HORIZON_MARGIN + sqrt(2.0 * reach / HEAD_MM));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= total_knot_count(strand_view.coarse)) {
        return;
    }
    let hair = hair_of_knot(index);
    let row = row_of_knot(index, hair);
    var knot = project_knot(posed[row].xyz, posed[row].w);
    var covered = false;
    if (is_coarse(hair)) {
        let is_last = index - first_knot(hair) + 1u == hairs.coarse_knots;
        covered = is_last;
        if (is_behind_head(row_of_hair(hair))) {
            knot.width = -1.0;
            covered = true;
        } else if (!is_last && posed[row].w >= 0.0) {
            covered = is_segment_covered(knot, project_knot(posed[row + 1u].xyz, posed[row + 1u].w));
        }
    }
    knot.covered = u32(covered);
    projected[index] = knot;
}
