// Draws the segments of a tile by a workgroup, whose invocations form several layers of one invocation per pixel. Invocations
// of the first layer load segments, each from one linked list of the tile; the loaded segments are distributed among the
// layers. The including shader defines `visit_segment`, and `begin_pixel`, which is called before the first segment.
//#include "strand_fragments.wgsl"

const LANES: u32 = STRAND_TILE * STRAND_TILE; // invocations of a layer: the pixels of a tile
const LAYERS: u32 = 4u; // more layers speed up tiles with many segments

@group(0) @binding(31) var<storage, read> list_heads: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;

var<workgroup> segments: array<Segment, LANES>;
var<workgroup> found: atomic<u32>;
var<workgroup> count: u32;

// Returns whether there is any segment.
fn visit_segments(pixel: vec2u, tile: vec2u, lane: u32, layer: u32) -> bool {
    var link = 0u;
    if (layer == 0u && lane < SEGMENT_LISTS) {
        link = list_heads[1u + (tile.y * tiles_across(strand_view.size) + tile.x) * SEGMENT_LISTS + lane];
    }
    var any = false;
    loop {
        if (lane + layer == 0u) {
            atomicStore(&found, 0u);
        }
        workgroupBarrier();
        if (link != 0u) {
            let one = links[link - 1u];
            segments[atomicAdd(&found, 1u)] = load_segment(one.x);
            link = one.y;
        }
        workgroupBarrier();
        if (lane + layer == 0u) {
            count = atomicLoad(&found);
        }
        let many = workgroupUniformLoad(&count);
        if (many == 0u) {
            break;
        }
        if (!any) {
            begin_pixel(pixel);
        }
        any = true;
        for (var k = layer; k < many; k += LAYERS) {
            visit_segment(fragment_of(vec2f(pixel) + 0.5, segments[k]));
        }
        workgroupBarrier();
    }
    return any;
}
