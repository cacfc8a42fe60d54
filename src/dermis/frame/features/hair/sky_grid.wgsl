// Declarations shared by the passes that fill the grid of strand_sky.wgsl.
//#include "shape/geometry.wgsl"
//#include "surface/surface.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_window.wgsl"

@group(0) @binding(31) var<storage, read_write> opacity: array<atomic<u32>>; // see strand_window.wgsl

fn sky_grid() -> SkyGrid {
    let low = vec3u(atomicLoad(&opacity[0]), atomicLoad(&opacity[1]), atomicLoad(&opacity[2]));
    let high = vec3u(atomicLoad(&opacity[3]), atomicLoad(&opacity[4]), atomicLoad(&opacity[5]));
    return make_sky_grid(low, high);
}

// Whether a position, in cells from the corner of the grid, is inside.
fn in_grid(at: vec3f) -> bool {
    return all(at >= vec3f(0.0)) && all(at < vec3f(SKY_CELLS));
}
