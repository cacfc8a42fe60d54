// What the centre of a pixel sees of the mesh.
//#include "seen_point.wgsl"

struct Look {
    rays: Rays,
    centre: vec3f, // origin of the scene's places, in the mesh's own
}

// The mesh where a pixel's centre meets it.
struct Seen {
    triangle: u32,
    corners: vec4u, // and flags
    weights: vec3f, // of the corners
    point: Point,
    pixel: vec2u,
}

@group(0) @binding(50) var<uniform> look: Look;
@group(0) @binding(51) var centres: texture_2d_array<u32>; // triangle + 1 at the centre of each pixel

// That of any triangle where nothing is seen.
fn seen_at(pixel: vec2u, size: vec2u) -> Seen {
    let triangle = max(textureLoad(centres, pixel, 0, 0).x, 1u) - 1u;
    let t = triangle_at(triangle);
    let w = weights_under(t, ray_to(look.rays, vec2f(pixel) + 0.5, vec2f(size)), look.rays.eye);
    return Seen(triangle, t, w, point_under(triangle, w), pixel);
}

fn sees_any(pixel: vec2u) -> bool {
    return textureLoad(centres, pixel, 0, 0).x > 0u;
}
