// The point of the mesh at the centre of a pixel.
//#include "visibility/ray_hit.wgsl"

struct OutputCamera {
    rays: Rays,
    centre: vec3f, // origin of the scene in the space of the mesh [mm]
}

// The point of the mesh that a ray hits.
struct SurfaceHit {
    triangle: u32,
    corners: vec4u, // vertices, and flags
    weights: vec3f, // barycentric weights of the corners
    point: Point,
    pixel: vec2u,
}

alias Seen = SurfaceHit; // its name up to release 0.1

@group(0) @binding(50) var<uniform> camera: OutputCamera;
@group(0) @binding(51) var centres: texture_2d_array<u32>; // triangle + 1 at the centre of each pixel

// Position of a point in the picture, from -1 to 1 to the right and up, and its depth [mm].
fn project_ndc(rays: Rays, p: vec3f) -> vec3f {
    let offset = p - rays.eye;
    let depth = dot(offset, rays.forward);
    let across = vec2f(dot(offset, rays.right) / dot(rays.right, rays.right), dot(offset, rays.up) / dot(rays.up, rays.up));
    return vec3f(across / depth - rays.shift, depth);
}

// Position of a point in pixels to the right and down, and its depth [mm].
fn project_pixels(rays: Rays, p: vec3f, size: vec2f) -> vec3f {
    let ndc = project_ndc(rays, p);
    return vec3f((0.5 + vec2f(0.5, -0.5) * ndc.xy) * size, ndc.z);
}

// The point of an edge that is nearest to a position in the picture: weights of its ends, and the distance [pixel].
fn nearest_on_edge(a: vec3f, b: vec3f, position: vec2f) -> vec3f {
    let along = b.xy - a.xy;
    let t = clamp(dot(position - a.xy, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
    let w = vec2f(1.0 - t, t) / vec2f(a.z, b.z);
    return vec3f(w / (w.x + w.y), distance(position, a.xy + t * along));
}

// Barycentric weights of the hit in a triangle with corners `t`. Rasterisers may hit a triangle slightly outside, above all at
// grazing angles; then it is the point that is nearest in the picture, as the nearest one in its plane may be far away there.
fn hit_weights(t: vec4u, position: vec2f, size: vec2f) -> vec3f {
    let a = position_of(t.x);
    let b = position_of(t.y);
    let c = position_of(t.z);
    let w = meet(ray_to_weights(camera.rays.eye, a, b, c), ray_to(camera.rays, position, size));
    if (min(min(w.x, w.y), w.z) >= 0.0) {
        return within(w);
    }
    let p = project_pixels(camera.rays, a, size);
    let q = project_pixels(camera.rays, b, size);
    let r = project_pixels(camera.rays, c, size);
    let ab = nearest_on_edge(p, q, position);
    let bc = nearest_on_edge(q, r, position);
    let ca = nearest_on_edge(r, p, position);
    let least = min(min(ab.z, bc.z), ca.z);
    let others = select(vec3f(ca.y, 0.0, ca.x), vec3f(0.0, bc.xy), bc.z == least);
    return select(others, vec3f(ab.xy, 0.0), ab.z == least);
}

// The hit of a pixel; of an arbitrary triangle if there is none.
fn hit_at(pixel: vec2u, size: vec2u) -> SurfaceHit {
    let triangle = max(textureLoad(centres, pixel, 0, 0).x, 1u) - 1u;
    let t = triangle_at(triangle);
    let w = hit_weights(t, vec2f(pixel) + 0.5, vec2f(size));
    return SurfaceHit(triangle, t, w, point_on_triangle(triangle, w), pixel);
}

fn is_hit(pixel: vec2u) -> bool {
    return textureLoad(centres, pixel, 0, 0).x > 0u;
}
