// Clears the grid of colliders.
//#include "each.wgsl"
//#include "swing_grid.wgsl"

@group(0) @binding(27) var<storage, read_write> cells: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index < arrayLength(&cells)) {
        cells[index] = NO_COLLIDER;
    }
}
