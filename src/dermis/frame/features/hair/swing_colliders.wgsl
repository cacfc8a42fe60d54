// Copies the vertices of skin and clothing that keep hair outside, and enters them into the cells of the grid around them.
//#include "each.wgsl"
//#include "shape/geometry.wgsl"
//#include "swing_grid.wgsl"

@group(0) @binding(25) var<storage, read> collider_vertices: array<u32>;
@group(0) @binding(26) var<storage, read_write> colliders: array<vec4f>; // of each collider: position; normal
@group(0) @binding(27) var<storage, read_write> cells: array<atomic<u32>>;

fn enter(cell: vec3i, index: u32, at: vec3f) {
    if (any(cell < vec3i(0)) || any(cell >= vec3i(GRID_CELLS))) {
        return;
    }
    let away = CELL_MM * length(vec3f(cell) + 0.5 - at);
    let word = (u32(DISTANCE_STEPS * away) << INDEX_BITS) | index;
    atomicMin(&cells[grid_cell_index(vec3u(cell))], word);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&collider_vertices)) {
        return;
    }
    let vertex = corner_at(collider_vertices[index]);
    colliders[2u * index] = vec4f(vertex.position, 0.0);
    colliders[2u * index + 1u] = vec4f(vertex.normal, 0.0);
    let at = (vertex.position - swing.low) / CELL_MM;
    let middle = vec3i(floor(at));
    for (var z = -1; z <= 1; z += 1) {
        for (var y = -1; y <= 1; y += 1) {
            for (var x = -1; x <= 1; x += 1) {
                enter(middle + vec3i(x, y, z), index, at);
            }
        }
    }
}
