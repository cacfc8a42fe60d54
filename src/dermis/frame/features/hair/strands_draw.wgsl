// Draws strands over the picture: each pixel keeps its nearest fragments and composites them over the radiance behind the
// hair.
//#include "strand_rows.wgsl"
//#include "strand_labels.wgsl"

@group(0) @binding(34) var behind: texture_2d<f32>; // radiance and coverage
@group(0) @binding(35) var image: texture_storage_2d<rgba32float, write>;

fn pass_through(pixel: vec2u) {
    store_label(pixel);
    textureStore(image, pixel, textureLoad(behind, pixel, 0));
}

fn draw_pixel(pixel: vec2u, first: u32) {
    let depths = depths_at(pixel);
    clear_fragments();
    begin_labels(pixel);
    for (var link = first; link != 0u; link = links[link - 1u].y) {
        var one = fragment_of(vec2f(pixel) + 0.5, load_segment(links[link - 1u].x));
        label_fragment(one);
        one.cover *= visible_fraction(one.depth, depths);
        if (one.cover > 0.0) {
            add_fragment(one);
        }
    }
    store_label(pixel);
    textureStore(image, pixel, composite(textureLoad(behind, pixel, 0)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    draw_rows(id.xy, textureDimensions(image));
}
