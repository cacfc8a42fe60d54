// The class of the hairs over each pixel.
//#include "hair_class.wgsl"
//#include "strand_rows.wgsl"

fn put(pixel: vec2u, label: u32) {
    hair_labels[pixel.y * u32(strand_view.size.x) + pixel.x] = label;
}

fn leave(pixel: vec2u) {
    put(pixel, 0u);
}

fn cover(pixel: vec2u, first: u32) {
    let depths = depths_at(pixel);
    var sum = NO_HAIRS;
    for (var link = first; link != 0u; link = links[link - 1u].y) {
        sum = with_piece(sum, fragment_of(vec2f(pixel) + 0.5, hold(links[link - 1u].x)), depths.first.x);
    }
    put(pixel, labels_of(sum));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    cover_rows(id.xy, vec2u(strand_view.size));
}
