// Outputs of the surface including its relief, at the centre of each pixel.
//#include "hit_footprint.wgsl"
//#include "surface/skin.wgsl"
//#include "each_hit.wgsl"

//#include <surface_outputs>
//#each surface_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

// Normal with relief; eyes and teeth have the normal of the mesh.
fn normal_output(hit: SurfaceHit) -> vec3f {
    if ((hit.point.flags & OPAQUE) != 0u) {
        return hit.point.normal;
    }
    return surface_at(hit.point, footprint_at(hit)).normal;
}

fn normal_camera_output(hit: SurfaceHit) -> vec3f {
    let n = normal_output(hit);
    return vec3f(dot(n, normalize(camera.rays.right)), -dot(n, normalize(camera.rays.up)), dot(n, camera.rays.forward));
}

fn write_outputs(hit: SurfaceHit, found_hit: bool, slot: PixelSlot) {
    //#each surface_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, select({nothing}, {name}_output(hit), found_hit)); }}
}
