// Outputs that depend on the mesh alone, at the centre of each pixel.
//#include "each_hit.wgsl"

//#include <geometry_outputs>
//#each geometry_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

fn depth_output(hit: SurfaceHit) -> f32 {
    return dot(hit.point.position - camera.rays.eye, camera.rays.forward);
}

fn position_output(hit: SurfaceHit) -> vec3f {
    return hit.point.position - camera.centre;
}

fn normal_geometric_output(hit: SurfaceHit) -> vec3f {
    let a = position_of(hit.corners.x);
    return normalize(cross(position_of(hit.corners.y) - a, position_of(hit.corners.z) - a));
}

fn uv_output(hit: SurfaceHit) -> vec2f {
    return hit.point.uv;
}

fn triangle_output(hit: SurfaceHit) -> i32 {
    return i32(hit.triangle);
}

fn barycentric_output(hit: SurfaceHit) -> vec3f {
    return hit.weights;
}

fn write_outputs(hit: SurfaceHit, found_hit: bool, slot: PixelSlot) {
    //#each geometry_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, select({nothing}, {name}_output(hit), found_hit)); }}
}
