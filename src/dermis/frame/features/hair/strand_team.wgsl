// Draws the segments of a tile by a workgroup, whose invocations form several layers of one invocation per pixel. Invocations
// of the first layer load segments, each from one linked list of the tile; the loaded segments are distributed among the
// layers. Segments behind the surface of all pixels are left out. The including shader defines `visit_segment`, and
// `begin_pixel`, which is called before the first segment and returns the largest depth of the surface at the pixel.
//#include "strand_fragments.wgsl"

const LANES: u32 = TEAM_TILE * TEAM_TILE; // invocations of a layer: the pixels of a tile
const LAYERS: u32 = 4u; // more layers speed up tiles with many segments

@group(0) @binding(31) var<storage, read> list_heads: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;

var<workgroup> segments: array<Segment, LANES>;
var<workgroup> found: atomic<u32>;
var<workgroup> count: u32;
var<workgroup> farthest: atomic<u32>; // largest depth of the surface in the tile; its bits are ordered like the number

// Next link of a list, from `first` on, whose segment is not behind the surface; 0 if there is none.
fn next_visible(first: u32, depth: f32) -> u32 {
    var link = first;
    loop {
        if (link == 0u) {
            break;
        }
        let one = links[link - 1u];
        let begin = first_knot_of(one.x);
        if (min(projected[begin].depth, projected[begin + 1u].depth) < depth) {
            break;
        }
        link = one.y;
    }
    return link;
}

// Number of segments or links that invocations have counted in `found`, which is reset.
fn shared_count(index: u32) -> u32 {
    workgroupBarrier();
    if (index == 0u) {
        count = atomicExchange(&found, 0u);
    }
    return workgroupUniformLoad(&count);
}

// Returns whether there is any segment.
fn visit_segments(pixel: vec2u, tile: vec2u, lane: u32, layer: u32) -> bool {
    let index = LANES * layer + lane;
    if (index == 0u) {
        atomicStore(&found, 0u);
        atomicStore(&farthest, 0u);
    }
    workgroupBarrier();
    var link = 0u;
    if (layer == 0u && lane < SEGMENT_LISTS) {
        link = list_heads[1u + (tile.y * tiles_across(strand_view.size) + tile.x) * SEGMENT_LISTS + lane];
        if (link != 0u) {
            atomicAdd(&found, 1u);
        }
    }
    if (shared_count(index) == 0u) {
        return false;
    }
    let depth = begin_pixel(pixel);
    if (layer == 0u) {
        atomicMax(&farthest, bitcast<u32>(max(depth, 0.0)));
    }
    workgroupBarrier();
    let limit = bitcast<f32>(atomicLoad(&farthest));
    loop {
        link = next_visible(link, limit);
        if (link != 0u) {
            let one = links[link - 1u];
            segments[atomicAdd(&found, 1u)] = load_segment(one.x);
            link = one.y;
        }
        let many = shared_count(index);
        if (many == 0u) {
            break;
        }
        for (var k = layer; k < many; k += LAYERS) {
            visit_segment(fragment_of(vec2f(pixel) + 0.5, segments[k]));
        }
        workgroupBarrier();
    }
    return true;
}
