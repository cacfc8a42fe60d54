// Thickness of the tissue at the centre of each pixel.
//#include "bilinear.wgsl"
//#include "each_hit.wgsl"

//#include <thickness_outputs>
//#each thickness_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

@group(0) @binding(53) var thickness_map: texture_2d<f32>; // of the coarse atlas [mm]; 1 where there is surface

fn thickness_output(hit: SurfaceHit) -> f32 {
    let sampled = load_bilinear(thickness_map, hit.point.atlas_uv);
    return select(0.0, sampled.x / max(sampled.a, 1e-6), (hit.point.flags & MAPPED) != 0u);
}

fn write_outputs(hit: SurfaceHit, found_hit: bool, slot: PixelSlot) {
    //#each thickness_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, select({nothing}, {name}_output(hit), found_hit)); }}
}
