// Packs pixels of four bytes to three bytes without gaps, which reduces the readback.

const ROW: u32 = 1024u; // invocations of a row

@group(0) @binding(0) var bytes: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> packed: array<u32>;

fn pixel(index: u32) -> u32 {
    let size = textureDimensions(bytes);
    let p = textureLoad(bytes, vec2u(index % size.x, min(index / size.x, size.y - 1u)), 0);
    return p.r | (p.g << 8u) | (p.b << 16u);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (3u * index >= arrayLength(&packed)) {
        return;
    }
    let a = pixel(4u * index);
    let b = pixel(4u * index + 1u);
    let c = pixel(4u * index + 2u);
    let d = pixel(4u * index + 3u);
    packed[3u * index] = a | (b << 24u);
    packed[3u * index + 1u] = (b >> 8u) | (c << 16u);
    packed[3u * index + 2u] = (c >> 16u) | (d << 8u);
}
