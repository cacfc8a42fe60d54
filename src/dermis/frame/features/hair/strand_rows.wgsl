// Loop over the column of pixels that one invocation draws. The including shader defines `draw_pixel` for pixels that strands
// may cover, and `pass_through` for all other pixels. These are skipped in a loop, because software adapters run both sides of
// a branch.
//#include "strand_fragments.wgsl"

override ROWS: u32 = 1u; // pixels of an invocation; see `rows_per_invocation`

@group(0) @binding(31) var<storage, read> list_heads: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;

fn chain_at(pixel: vec2u) -> u32 {
    return list_heads[1u + pixel.y / STRAND_TILE * tiles_across(strand_view.size) + pixel.x / STRAND_TILE];
}

// Next pixel that strands may cover.
fn next_covered(first: vec2u, end: u32) -> vec2u {
    var at = first;
    loop {
        if (at.y >= end || chain_at(at) != 0u) {
            break;
        }
        pass_through(at);
        at.y += 1u;
    }
    return at;
}

fn draw_rows(id: vec2u, size: vec2u) {
    let first = vec2u(id.x, id.y * ROWS);
    if (any(first >= size)) {
        return;
    }
    let end = min(first.y + ROWS, size.y);
    var at = next_covered(first, end);
    if (at.y >= end) {
        return;
    }
    loop {
        draw_pixel(at, chain_at(at));
        at = next_covered(at + vec2u(0u, 1u), end);
        if (at.y >= end) {
            break;
        }
    }
}
