// Outputs of the surface with its relief, at the centre of each pixel.
//#include "seen.wgsl"
//#include "skin.wgsl"
//#include "footprint.wgsl"
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

// Of the whole pixel.
fn footprint_at(seen: Seen) -> f32 {
    let size = vec2f(textureDimensions(centres));
    let a = corner_at(seen.corners.x);
    let b = corner_at(seen.corners.y);
    let c = corner_at(seen.corners.z);
    let weights = ray_to_weights(look.rays.eye, a.position, b.position, c.position);
    let place = vec2f(seen.pixel) + 0.5;
    let w = meet(weights, ray_to(look.rays, place, size));
    let wx = meet(weights, ray_to(look.rays, place + vec2f(1.0, 0.0), size)) - w;
    let wy = meet(weights, ray_to(look.rays, place + vec2f(0.0, 1.0), size)) - w;
    return footprint_of(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv, wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
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
