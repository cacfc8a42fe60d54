// Where landmarks are, and whether the picture shows them.
//#include "each.wgsl"
//#include "surface_hit.wgsl"

override TOLERANCE_MM: f32; // by which the mesh may lie before a landmark that is seen

struct Landmark {
    corner: vec4u, // points whose mean it is
    share: vec4f, // and their shares
    material: vec4u, // index + 1 of the material that has to be seen there, 0 for any near it
}

@group(0) @binding(56) var<storage, read> points: array<f32>; // three of each [mm]
@group(0) @binding(57) var<storage, read> landmarks: array<Landmark>;
@group(0) @binding(58) var<storage, read_write> found: array<vec4f>; // place, and 1 for one that is seen

fn point_at(index: u32) -> vec3f {
    return vec3f(points[3u * index], points[3u * index + 1u], points[3u * index + 2u]);
}

// Whether a pixel's centre sees past everything before a place.
fn is_free(pixel: vec2u, size: vec2u, p: vec3f, material: u32) -> bool {
    if (!sees_any(pixel)) {
        return material == 0u;
    }
    let seen = seen_at(pixel, size);
    if (material > 0u) {
        return seen.corners.w >> 8u == material - 1u;
    }
    return dot(p - seen.point.position, look.rays.forward) < TOLERANCE_MM;
}

// Whether one of the four pixels whose centres are around a place is free.
fn is_seen(p: vec3f, material: u32) -> bool {
    let size = textureDimensions(centres);
    let at = projected(look.rays, p, vec2f(size));
    let place = at.xy;
    if (at.z <= 0.0 || any(place < vec2f(0.0)) || any(place >= vec2f(size))) {
        return false;
    }
    let last = vec2i(size) - 1;
    for (var k = 0; k < 4; k += 1) {
        let pixel = clamp(vec2i(floor(place - 0.5)) + vec2i(k & 1, k >> 1u), vec2i(0), last);
        if (is_free(vec2u(pixel), size, p, material)) {
            return true;
        }
    }
    return false;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&landmarks)) {
        return;
    }
    let one = landmarks[index];
    let c = one.corner;
    let p = mat4x3f(point_at(c.x), point_at(c.y), point_at(c.z), point_at(c.w)) * one.share;
    found[index] = vec4f(p - look.centre, select(0.0, 1.0, is_seen(p, one.material.x)));
}
