// Copies depths from the buffer of the compute pass to the layers of a texture, and clears the buffer for the next frame.
//#include "resolve.wgsl"

@group(0) @binding(31) var<storage, read_write> nearness: array<u32>;
@group(0) @binding(33) var layers: texture_storage_2d_array<r32float, write>;

fn value_at(at: u32) -> u32 {
    return nearness[at];
}

fn clear(at: u32) {
    nearness[at] = 0u;
}

fn store(pixel: vec2u, layer: u32, bits: u32) {
    textureStore(layers, pixel, layer, vec4f(bitcast<f32>(bits)));
}
