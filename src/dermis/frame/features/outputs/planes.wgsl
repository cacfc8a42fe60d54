// Where outputs go: one after the other, each as rows of pixels with its channels side by side.

const UNASKED: u32 = 0xffffffffu; // in the place of an output's first channel

// Where a pixel is among all.
struct Cell {
    index: u32,
    pixels: u32,
}

@group(0) @binding(52) var<storage, read_write> planes: array<u32>;

fn cell_of(pixel: vec2u, size: vec2u) -> Cell {
    return Cell(pixel.y * size.x + pixel.x, size.x * size.y);
}

// first: channels of the outputs before it
fn put_u32(first: u32, cell: Cell, value: u32) {
    planes[first * cell.pixels + cell.index] = value;
}

fn put_i32(first: u32, cell: Cell, value: i32) {
    put_u32(first, cell, bitcast<u32>(value));
}

fn put_f32(first: u32, cell: Cell, value: f32) {
    put_u32(first, cell, bitcast<u32>(value));
}

fn put_vec2f(first: u32, cell: Cell, value: vec2f) {
    let at = first * cell.pixels + 2u * cell.index;
    planes[at] = bitcast<u32>(value.x);
    planes[at + 1u] = bitcast<u32>(value.y);
}

fn put_vec3f(first: u32, cell: Cell, value: vec3f) {
    let at = first * cell.pixels + 3u * cell.index;
    planes[at] = bitcast<u32>(value.x);
    planes[at + 1u] = bitcast<u32>(value.y);
    planes[at + 2u] = bitcast<u32>(value.z);
}

fn get_vec3f(first: u32, cell: Cell) -> vec3f {
    let at = first * cell.pixels + 3u * cell.index;
    return bitcast<vec3f>(vec3u(planes[at], planes[at + 1u], planes[at + 2u]));
}
