// Deep opacity map of the picture: the cover by hair in front of a depth, by which strands that cannot be seen are left out.
//#include "opacity_layers.wgsl"
//#include "strand_view.wgsl"

const VIEW_TEXEL: f32 = 4.0; // side of a texel [pixel]
const VIEW_DEPTH_OFFSET: f32 = 1000.0; // added to depths, which may be negative behind the eye [mm]

fn view_map_size() -> vec2i {
    return vec2i(ceil(strand_view.size / VIEW_TEXEL));
}

fn view_map_word(texel: vec2i) -> u32 {
    return TEXEL_WORDS * u32(texel.y * view_map_size().x + texel.x);
}
