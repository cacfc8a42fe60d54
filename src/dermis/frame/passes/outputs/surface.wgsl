// Outputs of the surface with its relief, at the centre of each pixel.
//#include "seen_footprint.wgsl"
//#include "skin.wgsl"
//#include "planes.wgsl"

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

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let seen = seen_at(id.xy, size);
    let there = sees_any(id.xy);
    let cell = cell_of(id.xy, size);
    //#each surface_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
