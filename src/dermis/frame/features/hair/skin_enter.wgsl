// Copies the vertices of the skin that keep hair outside, and enters them into the cells of the grid around them.
//#include "each.wgsl"
//#include "shape/geometry.wgsl"
//#include "skin_grid.wgsl"

//#fill const MEDIUM_STRIDE: u32 = {medium_vertex_stride}; // one of so many vertices is entered at a distance of two cells,
//#fill const FAR_STRIDE: u32 = {far_vertex_stride}; // and one of so many at a distance of up to
//#fill const FAR_REACH: i32 = {far_reach}; // cells

@group(0) @binding(25) var<storage, read> skin_vertices: array<u32>;
@group(0) @binding(26) var<storage, read_write> skin: array<atomic<u32>>;

fn enter(cell: vec3i, index: u32, at: vec3f) {
    if (any(cell < vec3i(0)) || any(cell >= vec3i(SKIN_CELLS))) {
        return;
    }
    let away = SKIN_CELL_MM * length(vec3f(cell) + 0.5 - at);
    let word = (u32(SKIN_DISTANCE_STEPS * away) << SKIN_INDEX_BITS) | index;
    atomicMin(&skin[skin_cell_index(vec3u(cell))], word);
}

fn store(word: u32, value: vec3f) {
    for (var k = 0u; k < 3u; k += 1u) {
        atomicStore(&skin[word + k], bitcast<u32>(value[k]));
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&skin_vertices)) {
        return;
    }
    let vertex = corner_at(skin_vertices[index]);
    store(skin_vertex_word(index), vertex.position);
    store(skin_vertex_word(index) + 3u, vertex.normal);
    let at = (vertex.position - SKIN_LOW) / SKIN_CELL_MM;
    let middle = vec3i(floor(at));
    let reach = select(select(1, 2, index % MEDIUM_STRIDE == 0u), FAR_REACH, index % FAR_STRIDE == 0u);
    for (var z = -reach; z <= reach; z += 1) {
        for (var y = -reach; y <= reach; y += 1) {
            for (var x = -reach; x <= reach; x += 1) {
                enter(middle + vec3i(x, y, z), index, at);
            }
        }
    }
}
