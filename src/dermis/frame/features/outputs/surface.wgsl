// Outputs of the surface with its relief, at the centre of each pixel.
//#include "hit_footprint.wgsl"
//#include "surface/skin.wgsl"
//#include "each_hit.wgsl"

//#include <surface_outputs>
//#each surface_outputs: override {NAME}_FIRST: u32 = UNASKED;

// That of eyes and teeth is the mesh's.
fn normal_output(seen: Seen) -> vec3f {
    if ((seen.point.flags & OPAQUE) != 0u) {
        return seen.point.normal;
    }
    return surface_at(seen.point, footprint_at(seen)).normal;
}

fn normal_camera_output(seen: Seen) -> vec3f {
    let n = normal_output(seen);
    return vec3f(dot(n, normalize(look.rays.right)), -dot(n, normalize(look.rays.up)), dot(n, look.rays.forward));
}

fn put_seen(seen: Seen, there: bool, cell: Cell) {
    //#each surface_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
