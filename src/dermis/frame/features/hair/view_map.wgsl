// Deep opacity map of the picture: the cover by hair in front of a depth, by which strands that cannot be seen are left out.
//#include "opacity_layers.wgsl"
//#include "strand_view.wgsl"

//#fill const VIEW_TEXEL: f32 = {view_texel}.0; // side of a texel [pixel]

fn view_map_size() -> vec2i {
    return vec2i(ceil(strand_view.size / VIEW_TEXEL));
}

fn view_map_word(texel: vec2i) -> u32 {
    return TEXEL_WORDS * u32(texel.y * view_map_size().x + texel.x);
}
