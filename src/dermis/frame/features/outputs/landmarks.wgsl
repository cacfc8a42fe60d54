// Positions of landmarks, and whether they are visible in the picture.
//#include "each.wgsl"
//#include "surface_hit.wgsl"

override TOLERANCE_MM: f32; // depth by which the mesh may be in front of a visible landmark
override HAIRS: bool = false; // whether hair is drawn

struct Landmark {
    corner: vec4u, // points of the mesh
    weight: vec4f, // their weights
    material: vec4u, // index + 1 of the material that has to be visible there, 0 for any surface nearby
}

@group(0) @binding(56) var<storage, read> points: array<f32>; // x, y, z [mm]
@group(0) @binding(57) var<storage, read> landmarks: array<Landmark>;
@group(0) @binding(58) var<storage, read_write> results: array<vec4f>; // position, and the cover by hair and beard, plus 2 if the mesh does not hide the landmark
@group(0) @binding(59) var<storage, read> hair_labels: array<u32>; // see strand_labels.wgsl

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

fn hair_cover(pixel: vec2u, size: vec2u) -> f32 {
    if (!HAIRS) {
        return 0.0;
    }
    return f32((hair_labels[pixel.y * size.x + pixel.x] >> 16u) & 0xffu) / 255.0;
}

// Cover by hair and beard, interpolated between the four pixels around a position, plus 2 if the position is unoccluded by
// the mesh in one of them.
fn seen_at(p: vec3f, material: u32) -> f32 {
    let size = textureDimensions(centres);
    let at = project_pixels(camera.rays, p, vec2f(size));
    let position = at.xy;
    if (at.z <= 0.0 || any(position < vec2f(0.0)) || any(position >= vec2f(size))) {
        return 0.0;
    }
    let last = vec2i(size) - 1;
    let share = fract(position - 0.5);
    var visible = false;
    var cover = 0.0;
    for (var k = 0; k < 4; k += 1) {
        let corner = vec2i(k & 1, k >> 1u);
        let pixel = vec2u(clamp(vec2i(floor(position - 0.5)) + corner, vec2i(0), last));
        visible = visible || is_unoccluded(pixel, size, p, material);
        let weight = select(1.0 - share, share, corner == vec2i(1));
        cover += weight.x * weight.y * hair_cover(pixel, size);
    }
    return select(0.0, 2.0, visible) + cover;
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
    results[index] = vec4f(p - camera.centre, seen_at(p, landmark.material.x));
}
