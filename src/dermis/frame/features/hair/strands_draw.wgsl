// Hairs over the picture: each pixel keeps the nearest pieces of hair that cover it and lays them over what it shows.
//#include "strand_rows.wgsl"
//#include "strand_labels.wgsl"

@group(0) @binding(34) var behind: texture_2d<f32>; // radiance and coverage
@group(0) @binding(35) var image: texture_storage_2d<rgba32float, write>;

fn leave(pixel: vec2u) {
    put_label(pixel);
    textureStore(image, pixel, textureLoad(behind, pixel, 0));
}

fn cover(pixel: vec2u, first: u32) {
    let depths = depths_at(pixel);
    take_none();
    begin_labels(pixel);
    for (var link = first; link != 0u; link = links[link - 1u].y) {
        var one = fragment_of(vec2f(pixel) + 0.5, hold(links[link - 1u].x));
        label_piece(one);
        one.cover *= free_share(one.depth, depths);
        if (one.cover > 0.0) {
            take(one);
        }
    }
    put_label(pixel);
    textureStore(image, pixel, laid_over(textureLoad(behind, pixel, 0)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    cover_rows(id.xy, textureDimensions(image));
}
