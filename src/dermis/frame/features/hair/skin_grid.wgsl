// Grid around a head whose cells name the vertex of the skin that is nearest to the middle of the cell, followed by the
// positions and normals of the vertices. Strands are kept outside the skin by it. See dermis/mesh/skin_grid.py.

//#fill const SKIN_CELLS: vec3u = vec3u({skin_cells_x}, {skin_cells_y}, {skin_cells_z});
//#fill const SKIN_LOW: vec3f = vec3f({skin_low_x}, {skin_low_y}, {skin_low_z}); // corner of the grid [mm]
//#fill const SKIN_CELL_MM: f32 = {skin_cell_mm};
//#fill const SKIN_VERTEX_WORDS: u32 = {skin_words_per_vertex};
const EMPTY_CELL: u32 = 0xffffffffu;
const SKIN_INDEX_BITS: u32 = 18u; // of a cell's word, the lower bits; the upper ones are the distance
const SKIN_DISTANCE_STEPS: f32 = 256.0; // per millimetre

fn skin_cell_index(cell: vec3u) -> u32 {
    return (cell.z * SKIN_CELLS.y + cell.y) * SKIN_CELLS.x + cell.x;
}

fn skin_vertex_word(index: u32) -> u32 {
    return SKIN_CELLS.x * SKIN_CELLS.y * SKIN_CELLS.z + SKIN_VERTEX_WORDS * index;
}
