// Outputs of the mesh: where the centre of each pixel meets it.
//#include "each_hit.wgsl"

//#include <geometry_outputs>
//#each geometry_outputs: override {NAME}_FIRST: u32 = UNASKED;

fn depth_output(seen: Seen) -> f32 {
    return dot(seen.point.position - look.rays.eye, look.rays.forward);
}

fn position_output(seen: Seen) -> vec3f {
    return seen.point.position - look.centre;
}

fn normal_geometric_output(seen: Seen) -> vec3f {
    let a = position_of(seen.corners.x);
    return normalize(cross(position_of(seen.corners.y) - a, position_of(seen.corners.z) - a));
}

fn uv_output(seen: Seen) -> vec2f {
    return seen.point.uv;
}

fn triangle_output(seen: Seen) -> i32 {
    return i32(seen.triangle);
}

fn barycentric_output(seen: Seen) -> vec3f {
    return seen.weights;
}

fn put_seen(seen: Seen, there: bool, cell: Cell) {
    //#each geometry_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
