// Positions of landmarks, and whether they are visible in the picture.
//#include "each.wgsl"
//#include "surface_hit.wgsl"

override TOLERANCE_MM: f32; // depth by which the mesh may be in front of a visible landmark

struct Landmark {
    corner: vec4u, // points of the mesh
    weight: vec4f, // their weights
    material: vec4u, // index + 1 of the material that has to be visible there, 0 for any surface nearby
}

@group(0) @binding(56) var<storage, read> points: array<f32>; // x, y, z [mm]
@group(0) @binding(57) var<storage, read> landmarks: array<Landmark>;
@group(0) @binding(58) var<storage, read_write> results: array<vec4f>; // position, and 1 if it is visible

fn point_at(index: u32) -> vec3f {
    return vec3f(points[3u * index], points[3u * index + 1u], points[3u * index + 2u]);
}

// Whether nothing hides a position at the centre of a pixel.
fn is_unoccluded(pixel: vec2u, size: vec2u, p: vec3f, material: u32) -> bool {
    if (!is_hit(pixel)) {
        return material == 0u;
    }
    let hit = hit_at(pixel, size);
    if (material > 0u) {
        return hit.corners.w >> 8u == material - 1u;
    }
    return dot(p - hit.point.position, camera.rays.forward) < TOLERANCE_MM;
}

// Whether a position is unoccluded in one of the four pixels around it.
fn is_visible(p: vec3f, material: u32) -> bool {
    let size = textureDimensions(centres);
    let at = project_pixels(camera.rays, p, vec2f(size));
    let position = at.xy;
    if (at.z <= 0.0 || any(position < vec2f(0.0)) || any(position >= vec2f(size))) {
        return false;
    }
    let last = vec2i(size) - 1;
    for (var k = 0; k < 4; k += 1) {
        let pixel = clamp(vec2i(floor(position - 0.5)) + vec2i(k & 1, k >> 1u), vec2i(0), last);
        if (is_unoccluded(vec2u(pixel), size, p, material)) {
            return true;
        }
    }
    return false;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&landmarks)) {
        return;
    }
    let landmark = landmarks[index];
    let c = landmark.corner;
    let p = mat4x3f(point_at(c.x), point_at(c.y), point_at(c.z), point_at(c.w)) * landmark.weight;
    results[index] = vec4f(p - camera.centre, select(0.0, 1.0, is_visible(p, landmark.material.x)));
}
