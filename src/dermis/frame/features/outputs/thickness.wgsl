// How thick the flesh is below what the centre of each pixel sees.
//#include "bilinear.wgsl"
//#include "each_hit.wgsl"

//#include <thickness_outputs>
//#each thickness_outputs: override {NAME}_FIRST: u32 = UNASKED;

@group(0) @binding(53) var thickness_map: texture_2d<f32>; // of the coarse atlas [mm]; 1 where there is surface

fn thickness_output(seen: Seen) -> f32 {
    let found = load_bilinear(thickness_map, seen.point.place);
    return select(0.0, found.x / max(found.a, 1e-6), (seen.point.flags & MAPPED) != 0u);
}

fn put_seen(seen: Seen, there: bool, cell: Cell) {
    //#each thickness_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
