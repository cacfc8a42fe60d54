// Empties the cells of the grid of the skin.
//#include "each.wgsl"
//#include "skin_grid.wgsl"

@group(0) @binding(0) var<storage, read_write> skin: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index < skin_vertex_word(0u)) {
        skin[index] = EMPTY_CELL;
    }
}
