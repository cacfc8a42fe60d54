// The point of the surface that a ray through the picture hits.
//#include "shape/geometry.wgsl"

// Camera rays.
struct Rays {
    eye: vec3f,
    forward: vec3f,
    right: vec3f, // scaled so that forward + (x + shift) right + (y + shift) up spans the image for x, y in -1..1
    up: vec3f,
    shift: vec2f, // offset of the middle of the picture from the axis
}

fn ray_to(rays: Rays, position: vec2f, size: vec2f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * position / size + vec2f(-1.0, 1.0);
    return rays.forward + (ndc.x + rays.shift.x) * rays.right + (ndc.y + rays.shift.y) * rays.up;
}

// Barycentric weights of the hit in a triangle with corners `t`, clamped to the triangle.
fn ray_weights(t: vec4u, ray: vec3f, eye: vec3f) -> vec3f {
    return within(meet(ray_to_weights(eye, position_of(t.x), position_of(t.y), position_of(t.z)), ray));
}

fn point_on_triangle(index: u32, weights: vec3f) -> Point {
    let t = triangle_at(index);
    var point = interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), weights, t.w);
    point.atlas_uv = atlas_position(index, weights);
    return point;
}
