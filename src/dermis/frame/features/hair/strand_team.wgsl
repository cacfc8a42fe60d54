// The pieces of hair of a tile, for the workgroup that does it. The invocations of its first layer each follow one of the tile's
// chains; what they find is shared out among the layers, each of which has an invocation for each pixel. What that makes of a
// piece is its own function `see_piece`, before the first of all `begin_pieces`.
//#include "strand_fragments.wgsl"

const LANES: u32 = STRAND_TILE * STRAND_TILE; // of a layer: the pixels of a tile
const LAYERS: u32 = 4u; // so that tiles of many pieces are done sooner

@group(0) @binding(31) var<storage, read> chains: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;

var<workgroup> held: array<Held, LANES>;
var<workgroup> found: atomic<u32>;
var<workgroup> count: u32;

// Whether there is any.
fn see_pieces(pixel: vec2u, tile: vec2u, lane: u32, layer: u32) -> bool {
    var link = 0u;
    if (layer == 0u && lane < WAYS) {
        link = chains[1u + (tile.y * tiles_across(strand_view.size) + tile.x) * WAYS + lane];
    }
    var any = false;
    loop {
        if (lane + layer == 0u) {
            atomicStore(&found, 0u);
        }
        workgroupBarrier();
        if (link != 0u) {
            let one = links[link - 1u];
            held[atomicAdd(&found, 1u)] = hold(one.x);
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
            begin_pieces(pixel);
        }
        any = true;
        for (var k = layer; k < many; k += LAYERS) {
            see_piece(fragment_of(vec2f(pixel) + 0.5, held[k]));
        }
        workgroupBarrier();
    }
    return any;
}
