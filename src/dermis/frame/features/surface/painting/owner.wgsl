// Finds the triangle that covers each texel of the skin's maps, or outside charts the nearest triangle.
//#include "each.wgsl"
//#include "painted_surface.wgsl"

@group(0) @binding(3) var<storage, read_write> owners: array<atomic<u32>>; // distance code and triangle + 1 of each texel, 0 for none

// Approximate distance of a point outside a triangle [texels].
fn outside(p: vec2f, corners: array<vec2f, 3>, turn: f32) -> f32 {
    var far = 0.0;
    for (var k = 0u; k < 3u; k++) {
        let a = corners[k];
        let side = corners[(k + 1u) % 3u] - a;
        let across = turn * (side.x * (p.y - a.y) - side.y * (p.x - a.x));
        far = max(far, -across / max(length(side), 1e-6));
    }
    return far;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&triangles) / 4u) {
        return;
    }
    let t = triangle_of(index);
    let side = f32(paint.side);
    let corners = array<vec2f, 3>(side * uv_of(t.x) - 0.5, side * uv_of(t.y) - 0.5, side * uv_of(t.z) - 0.5);
    let a = corners[1] - corners[0];
    let b = corners[2] - corners[0];
    let turn = sign(a.x * b.y - a.y * b.x);
    let margin = select(0.0, MARGIN, t.w > 0u); // only triangles at the border of a chart are extended
    let low = vec2i(max(ceil(min(min(corners[0], corners[1]), corners[2]) - margin), vec2f(0.0)));
    let high = vec2i(min(floor(max(max(corners[0], corners[1]), corners[2]) + margin), vec2f(side - 1.0)));
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let far = outside(vec2f(vec2i(x, y)), corners, turn);
            if (turn != 0.0 && far <= margin) {
                // the nearest triangle wins; on a shared edge, the last one
                let near = NEAREST - u32(far * STEPS);
                atomicMax(&owners[u32(y) * paint.side + u32(x)], (near << ID_BITS) | (index + 1u));
            }
        }
    }
}
