// Grid of the transmittance of hair in all directions, for light of the sky. It fills a box around all strands, and precedes the
// deep opacity maps of the lights in their buffer. In each cell, transmittance is a linear function of direction.

//#fill const SKY_CELLS: vec3u = vec3u({sky_cells_x}u, {sky_cells_y}u, {sky_cells_z}u);
//#fill const SKY_HEAD: u32 = {sky_head_words}; // words before the cells: bounds of the strands, as in strand_window.wgsl
//#fill const SKY_CELL_WORDS: u32 = {sky_cell_words}; // words of a cell: its content, then its transmittances

const HEAD_FLAG: u32 = 0x80000000u; // bit of the content of a cell: whether a triangle passes through it; the rest is area of strands
const AREA_SCALE: f32 = 1024.0; // integer of an area of 1 mm2

// Box around all coarse strands.
struct SkyGrid {
    low: vec3f, // [mm]
    cell: vec3f, // size of a cell [mm], 0 without strands
}

fn sky_cell_count() -> u32 {
    return SKY_CELLS.x * SKY_CELLS.y * SKY_CELLS.z;
}

// Words before the first deep opacity map.
fn sky_words() -> u32 {
    return SKY_HEAD + SKY_CELL_WORDS * sky_cell_count();
}

// Box with a margin of a cell on each side. low, high: bounds of all strands as `sortable` integers
fn make_sky_grid(low: vec3u, high: vec3u) -> SkyGrid {
    let first = from_sortable(low);
    let cell = max(from_sortable(high) - first, vec3f(0.0)) / vec3f(SKY_CELLS - 2u);
    return SkyGrid(first - cell, cell);
}

fn sky_cell_index(cell: vec3u) -> u32 {
    return (cell.z * SKY_CELLS.y + cell.y) * SKY_CELLS.x + cell.x;
}

fn content_word(index: u32) -> u32 {
    return SKY_HEAD + index;
}

// First of the words with the transmittances of a cell: past hair alone, past hair and head, then the moments of the light of the
// sky past hair.
fn transmittance_word(index: u32) -> u32 {
    return SKY_HEAD + sky_cell_count() + (SKY_CELL_WORDS - 1u) * index;
}

// Moments of the light of the sky: sums over directions d of the light, and of the light times the components of d and their
// products.
struct SkyMoments {
    first: vec4f, // x, y, z, and 1
    squares: vec3f, // xx, yy, zz
    mixed: vec3f, // xy, yz, zx
}

fn sky_moments(direction: vec3f, light: f32) -> SkyMoments {
    let scaled = light * direction;
    return SkyMoments(vec4f(scaled, light), scaled * direction, scaled * direction.yzx);
}

fn sum_of(a: SkyMoments, b: SkyMoments) -> SkyMoments {
    return SkyMoments(a.first + b.first, a.squares + b.squares, a.mixed + b.mixed);
}

// Light that a surface receives, up to a constant factor: the clamped cosine c is approximated by (3 + 16 c + 15 c^2) / 32.
// Source: [RamamoorthiHanrahan2001].
fn received(moments: SkyMoments, normal: vec3f) -> f32 {
    let square = dot(moments.squares, normal * normal) + 2.0 * dot(moments.mixed, normal * normal.yzx);
    return 3.0 * moments.first.w + 16.0 * dot(moments.first.xyz, normal) + 15.0 * square;
}
