// The class of the hairs over each pixel.
//#include "hair_class.wgsl"

override ROWS: u32 = 1u; // pixels of an invocation, one below the other; see `rows_of`

@group(0) @binding(31) var<storage, read> chains: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;

fn label_at(pixel: vec2u) -> u32 {
    let depths = depths_at(pixel);
    var sum = NO_HAIRS;
    let tile = pixel.y / STRAND_TILE * tiles_across(strand_view.size) + pixel.x / STRAND_TILE;
    for (var link = chains[1u + tile]; link != 0u; link = links[link - 1u].y) {
        sum = with_piece(sum, fragment_of(vec2f(pixel) + 0.5, hold(links[link - 1u].x)), depths.first.x);
    }
    return labels_of(sum);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2u(strand_view.size);
    let first = vec2u(id.x, id.y * ROWS);
    if (any(first >= size)) {
        return;
    }
    let end = min(first.y + ROWS, size.y);
    for (var y = first.y; y < end; y += 1u) {
        hair_labels[y * size.x + id.x] = label_at(vec2u(id.x, y));
    }
}
