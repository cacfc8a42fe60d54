// Holes that the opacity map cuts into some parts, such as cards of eyelashes and hair.
//#include "bilinear.wgsl"

override CUTOUTS: bool = false; // whether the head has such parts

//#if CUTOUTS
const CUT_OUT: u32 = 4u; // flag of their triangles

@group(0) @binding(36) var opacity_map: texture_2d<f32>; // shifted so that surfaces end at 0.5

fn is_solid(uv: vec2f) -> bool {
    return load_bilinear(opacity_map, uv).x >= 0.5;
}
//#end
