// Packs pixels of four floats to three or four floats without gaps, which reduces the readback.

override CHANNELS: u32 = 3u;

const ROW: u32 = 1024u; // invocations of a row

@group(0) @binding(0) var exposed: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> packed: array<f32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    let size = textureDimensions(exposed);
    if (index >= size.x * size.y) {
        return;
    }
    let colour = textureLoad(exposed, vec2u(index % size.x, index / size.x), 0);
    for (var k = 0u; k < CHANNELS; k += 1u) {
        packed[CHANNELS * index + k] = colour[k];
    }
}
