// What the centre of a pixel sees of the mesh.
//#include "visibility/ray_hit.wgsl"

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

// Where a point is in the picture, from -1 to 1 to the right and up, and its depth [mm].
fn in_picture(rays: Rays, p: vec3f) -> vec3f {
    let way = p - rays.eye;
    let depth = dot(way, rays.forward);
    let across = vec2f(dot(way, rays.right) / dot(rays.right, rays.right), dot(way, rays.up) / dot(rays.up, rays.up));
    return vec3f(across / depth - rays.shift, depth);
}

// The same in pixels to the right and down.
fn projected(rays: Rays, p: vec3f, size: vec2f) -> vec3f {
    let seen = in_picture(rays, p);
    return vec3f((0.5 + vec2f(0.5, -0.5) * seen.xy) * size, seen.z);
}

// The point of an edge that is nearest to a place in the picture: weights of its ends, and the distance [pixel].
fn nearest_on(a: vec3f, b: vec3f, place: vec2f) -> vec3f {
    let along = b.xy - a.xy;
    let t = clamp(dot(place - a.xy, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
    let w = vec2f(1.0 - t, t) / vec2f(a.z, b.z);
    return vec3f(w / (w.x + w.y), distance(place, a.xy + t * along));
}

// Weights within a triangle of corners `t`: rasterisers find some a little beside, those seen along their plane above all.
// There it is the point that looks nearest, as the nearest in the plane may look far away.
fn weights_at(t: vec4u, place: vec2f, size: vec2f) -> vec3f {
    let a = position_of(t.x);
    let b = position_of(t.y);
    let c = position_of(t.z);
    let w = meet(ray_to_weights(look.rays.eye, a, b, c), ray_to(look.rays, place, size));
    if (min(min(w.x, w.y), w.z) >= 0.0) {
        return within(w);
    }
    let p = projected(look.rays, a, size);
    let q = projected(look.rays, b, size);
    let r = projected(look.rays, c, size);
    let ab = nearest_on(p, q, place);
    let bc = nearest_on(q, r, place);
    let ca = nearest_on(r, p, place);
    let least = min(min(ab.z, bc.z), ca.z);
    let others = select(vec3f(ca.y, 0.0, ca.x), vec3f(0.0, bc.xy), bc.z == least);
    return select(others, vec3f(ab.xy, 0.0), ab.z == least);
}

// That of any triangle where nothing is seen.
fn seen_at(pixel: vec2u, size: vec2u) -> Seen {
    let triangle = max(textureLoad(centres, pixel, 0, 0).x, 1u) - 1u;
    let t = triangle_at(triangle);
    let w = weights_at(t, vec2f(pixel) + 0.5, vec2f(size));
    return Seen(triangle, t, w, point_on_triangle(triangle, w), pixel);
}

fn sees_any(pixel: vec2u) -> bool {
    return textureLoad(centres, pixel, 0, 0).x > 0u;
}
