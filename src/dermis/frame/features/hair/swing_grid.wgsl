// Grid around a head whose cells name the nearest collider: a vertex of the skin, with its normal, that keeps hair outside.

//#fill const GRID_CELLS: vec3u = vec3u({swing_cells_x}, {swing_cells_y}, {swing_cells_z});
//#fill const CELL_MM: f32 = {swing_cell_mm};
const NO_COLLIDER: u32 = 0xffffffffu;
const INDEX_BITS: u32 = 18u; // of a cell's word, the lower bits; the upper ones are the distance
const DISTANCE_STEPS: f32 = 256.0; // per millimetre

// Values of a step of the simulation, see swing_guides.wgsl.
struct Swing {
    gravity: vec3f, // acceleration by the change of gravity relative to the head since the first frame [mm/s2]
    substeps: u32,
    low: vec3f, // corner of the grid [mm]
    step_s: f32, // duration of a substep
    frame: u32,
}

@group(0) @binding(28) var<uniform> swing: Swing;

fn grid_cell_index(cell: vec3u) -> u32 {
    return (cell.z * GRID_CELLS.y + cell.y) * GRID_CELLS.x + cell.x;
}
