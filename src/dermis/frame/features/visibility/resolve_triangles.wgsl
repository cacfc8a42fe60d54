// Copies triangles from the buffers of the compute pass to the layers of a texture, and clears the buffers for the next frame.
//#include "resolve.wgsl"

@group(0) @binding(31) var<storage, read_write> nearness: array<u32>;
@group(0) @binding(32) var<storage, read_write> triangle_ids: array<u32>;
@group(0) @binding(33) var layers: texture_storage_2d_array<r32uint, write>;

fn value_at(at: u32) -> u32 {
    if (views.index_bits > 0u) {
        return nearness[at] & ((1u << views.index_bits) - 1u);
    }
    return triangle_ids[at];
}

fn clear(at: u32) {
    nearness[at] = 0u;
    if (views.index_bits == 0u) {
        triangle_ids[at] = 0u;
    }
}

fn store(pixel: vec2u, layer: u32, bits: u32) {
    textureStore(layers, pixel, layer, vec4u(bits));
}
