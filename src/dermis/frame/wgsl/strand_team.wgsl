// The pieces of hair of a tile, for the workgroup that does it: its invocations each follow one of the tile's chains and share
// what they find. What each makes of a piece is its own function `see_piece`, before the first of all `begin_pieces`.
//#include "strand_fragments.wgsl"

const LANES: u32 = 64u; // of a workgroup, which does a tile

@group(0) @binding(31) var<storage, read> chains: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;

var<workgroup> held: array<Held, LANES>;
var<workgroup> found: atomic<u32>;
var<workgroup> count: u32;

// Whether there is any.
fn see_pieces(pixel: vec2u, tile: vec2u, lane: u32) -> bool {
    var link = 0u;
    if (lane < WAYS) {
        link = chains[1u + (tile.y * tiles_across(strand_view.size) + tile.x) * WAYS + lane];
    }
    var any = false;
    loop {
        if (lane == 0u) {
            atomicStore(&found, 0u);
        }
        workgroupBarrier();
        if (link != 0u) {
            let one = links[link - 1u];
            held[atomicAdd(&found, 1u)] = hold(one.x);
            link = one.y;
        }
        workgroupBarrier();
        if (lane == 0u) {
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
        for (var k = 0u; k < many; k += 1u) {
            see_piece(fragment_of(vec2f(pixel) + 0.5, held[k]));
        }
        workgroupBarrier();
    }
    return any;
}
