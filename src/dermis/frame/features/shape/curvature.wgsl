// Curvature of the surface at its vertices: mean change of the normal over the triangles around a point, weighted by area.
//#include "geometry.wgsl"
//#include "each.wgsl"

const MIN_MM2: f32 = 1e-12; // least area of triangles around a point with curvature

@group(0) @binding(30) var<storage, read> around: array<vec4u>; // ranges of the triangles and of the neighbours of each vertex
@group(0) @binding(31) var<storage, read> triangles: array<u32>;
@group(0) @binding(32) var<storage, read_write> curvatures: array<f32>; // [1/mm]

// Symmetric derivative of the normal by position in a triangle, times its area [mm]; 0 without area.
fn bend_of(triangle: u32) -> mat3x3f {
    let t = triangle_at(triangle);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let s = b.position - a.position;
    let r = c.position - a.position;
    let across = cross(s, r);
    let size = length(across);
    if (size == 0.0) {
        return mat3x3f();
    }
    let unit = across / size;
    // dual basis of the two sides, times the area
    let along_s = 0.5 * cross(r, unit);
    let along_r = 0.5 * cross(unit, s);
    var m = b.normal - a.normal;
    var n = c.normal - a.normal;
    m -= dot(m, unit) * unit;
    n -= dot(n, unit) * unit;
    let bend = mat3x3f(
        along_s.x * m + along_r.x * n,
        along_s.y * m + along_r.y * n,
        along_s.z * m + along_r.z * n,
    );
    return 0.5 * (bend + transpose(bend));
}

fn area_of(triangle: u32) -> f32 {
    let t = triangle_at(triangle);
    let a = position_of(t.x);
    return 0.5 * length(cross(position_of(t.y) - a, position_of(t.z) - a));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&around)) {
        return;
    }
    let here = around[index];
    var bend = mat3x3f();
    var area = 0.0;
    for (var k = here.x; k < here.y; k++) {
        bend += bend_of(triangles[k]);
        area += area_of(triangles[k]);
    }
    // root mean square of the two principal curvatures
    let square = 0.5 * (dot(bend[0], bend[0]) + dot(bend[1], bend[1]) + dot(bend[2], bend[2]));
    curvatures[index] = sqrt(square) / max(area, MIN_MM2);
}
