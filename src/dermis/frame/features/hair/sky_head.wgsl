// Marks the cells of the grid of strand_sky.wgsl through which triangles of the head pass.
//#include "each.wgsl"
//#include "sky_grid.wgsl"

override TRIANGLES: u32 = 0u; // number of triangles of the head

const SIDE_PARTS: u32 = 3u; // parts into which the sides of a triangle are divided

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    let grid = sky_grid();
    if (index >= TRIANGLES || any(grid.cell <= vec3f(0.0))) {
        return;
    }
    let t = triangle_at(index);
    let a = position_of(t.x);
    let ab = position_of(t.y) - a;
    let ac = position_of(t.z) - a;
    for (var i = 0u; i <= SIDE_PARTS; i += 1u) {
        for (var k = 0u; k <= SIDE_PARTS - i; k += 1u) {
            let at = (a + (f32(i) * ab + f32(k) * ac) / f32(SIDE_PARTS) - grid.low) / grid.cell;
            if (in_grid(at)) {
                atomicOr(&opacity[content_word(sky_cell_index(vec3u(at)))], HEAD_FLAG);
            }
        }
    }
}
