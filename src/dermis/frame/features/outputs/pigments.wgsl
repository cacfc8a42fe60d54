// Pigments of the skin that the centre of each pixel sees, as shares of the volume.
//#include "hit_footprint.wgsl"
//#include "surface/skin.wgsl"
//#include "each_hit.wgsl"

//#include <pigments_outputs>
//#each pigments_outputs: override {NAME}_FIRST: u32 = UNASKED;

struct Pigments {
    everywhere: vec2f, // melanin and blood of skin that is alike everywhere
    painted: u32, // 1 where the map of roughness, as it was painted, has both beside it
}

@group(0) @binding(53) var<uniform> pigments: Pigments;

// None in eyes, teeth and tongue.
fn pigments_of(seen: Seen) -> vec2f {
    let mip = mip_for(roughness_map, footprint_at(seen));
    let painted = textureSampleLevel(roughness_map, map_sampler, seen.point.uv, mip).zw;
    let found = select(pigments.everywhere, painted, pigments.painted != 0u);
    return select(found, vec2f(0.0), (seen.point.flags & OPAQUE) != 0u);
}

fn melanin_output(seen: Seen) -> f32 {
    return pigments_of(seen).x;
}

fn blood_output(seen: Seen) -> f32 {
    return pigments_of(seen).y;
}

fn put_seen(seen: Seen, there: bool, cell: Cell) {
    //#each pigments_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
