// Buffer of the outputs of a stage, one output after the other; each output is an image with interleaved channels.

const NOT_REQUESTED: u32 = 0xffffffffu; // first channel of an output that is not requested

// Index of a pixel, and number of all pixels.
struct PlaneSlot {
    index: u32,
    pixels: u32,
}

@group(0) @binding(52) var<storage, read_write> planes: array<u32>;

fn plane_slot(pixel: vec2u, size: vec2u) -> PlaneSlot {
    return PlaneSlot(pixel.y * size.x + pixel.x, size.x * size.y);
}

// first: number of channels of the outputs before it
fn write_u32(first: u32, slot: PlaneSlot, value: u32) {
    planes[first * slot.pixels + slot.index] = value;
}

fn write_i32(first: u32, slot: PlaneSlot, value: i32) {
    write_u32(first, slot, bitcast<u32>(value));
}

fn write_f32(first: u32, slot: PlaneSlot, value: f32) {
    write_u32(first, slot, bitcast<u32>(value));
}

fn write_vec2f(first: u32, slot: PlaneSlot, value: vec2f) {
    let at = first * slot.pixels + 2u * slot.index;
    planes[at] = bitcast<u32>(value.x);
    planes[at + 1u] = bitcast<u32>(value.y);
}

fn write_vec3f(first: u32, slot: PlaneSlot, value: vec3f) {
    let at = first * slot.pixels + 3u * slot.index;
    planes[at] = bitcast<u32>(value.x);
    planes[at + 1u] = bitcast<u32>(value.y);
    planes[at + 2u] = bitcast<u32>(value.z);
}

fn read_vec3f(first: u32, slot: PlaneSlot) -> vec3f {
    let at = first * slot.pixels + 3u * slot.index;
    return bitcast<vec3f>(vec3u(planes[at], planes[at + 1u], planes[at + 2u]));
}
