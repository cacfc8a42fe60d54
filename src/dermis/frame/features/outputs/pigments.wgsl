// Pigments of the skin at the centre of each pixel, as volume fractions.
//#include "hit_footprint.wgsl"
//#include "surface/skin.wgsl"
//#include "each_hit.wgsl"

//#include <pigments_outputs>
//#each pigments_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

struct Pigments {
    uniform_pigments: vec2f, // melanin and blood of uniform skin
    painted: u32, // 1 if the painted map of roughness also holds the pigments
}

@group(0) @binding(53) var<uniform> pigments: Pigments;

// Melanin and blood fractions, zero in eyes, teeth and tongue.
fn pigments_at(hit: SurfaceHit) -> vec2f {
    let mip = mip_for(roughness_map, footprint_at(hit));
    let painted = textureSampleLevel(roughness_map, map_sampler, hit.point.uv, mip).zw;
    let value = select(pigments.uniform_pigments, painted, pigments.painted != 0u);
    return select(value, vec2f(0.0), (hit.point.flags & OPAQUE) != 0u);
}

fn melanin_output(hit: SurfaceHit) -> f32 {
    return pigments_at(hit).x;
}

fn blood_output(hit: SurfaceHit) -> f32 {
    return pigments_at(hit).y;
}

fn write_outputs(hit: SurfaceHit, found_hit: bool, slot: PixelSlot) {
    //#each pigments_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, select({nothing}, {name}_output(hit), found_hit)); }}
}
