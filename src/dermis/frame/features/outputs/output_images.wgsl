// Buffer of the outputs of a stage, one output after the other; each output is an image with interleaved channels.

const NOT_REQUESTED: u32 = 0xffffffffu; // first channel of an output that is not requested

// Index of a pixel, and number of all pixels.
struct PixelSlot {
    index: u32,
    pixels: u32,
}

@group(0) @binding(52) var<storage, read_write> output_images: array<u32>;

fn pixel_slot(pixel: vec2u, size: vec2u) -> PixelSlot {
    return PixelSlot(pixel.y * size.x + pixel.x, size.x * size.y);
}

// first: number of channels of the outputs before it
fn write_u32(first: u32, slot: PixelSlot, value: u32) {
    output_images[first * slot.pixels + slot.index] = value;
}

fn write_i32(first: u32, slot: PixelSlot, value: i32) {
    write_u32(first, slot, bitcast<u32>(value));
}

fn write_f32(first: u32, slot: PixelSlot, value: f32) {
    write_u32(first, slot, bitcast<u32>(value));
}

fn write_vec2f(first: u32, slot: PixelSlot, value: vec2f) {
    let at = first * slot.pixels + 2u * slot.index;
    output_images[at] = bitcast<u32>(value.x);
    output_images[at + 1u] = bitcast<u32>(value.y);
}

fn write_vec3f(first: u32, slot: PixelSlot, value: vec3f) {
    let at = first * slot.pixels + 3u * slot.index;
    output_images[at] = bitcast<u32>(value.x);
    output_images[at + 1u] = bitcast<u32>(value.y);
    output_images[at + 2u] = bitcast<u32>(value.z);
}

fn read_vec3f(first: u32, slot: PixelSlot) -> vec3f {
    let at = first * slot.pixels + 3u * slot.index;
    return bitcast<vec3f>(vec3u(output_images[at], output_images[at + 1u], output_images[at + 2u]));
}
