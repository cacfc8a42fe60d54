// Adds hair to a texel of a deep opacity map, whose texels have the layout of opacity_layers.wgsl. Integers are summed, so that the result
// does not depend on the order of strands.

@group(0) @binding(31) var<storage, read_write> opacity: array<atomic<u32>>;

override ADDS_COVER: bool = false; // whether to add cover; else to find the depth of the nearest strand

// word: first word of the texel
fn add_cover_to(word: u32, cover: f32, depth: f32) {
    if (!ADDS_COVER) {
        let integer_depth = u32(DEPTH_SCALE * max(depth, 0.0));
        if (integer_depth < atomicLoad(&opacity[word])) { // few are nearer, and atomic writes are slow
            atomicMin(&opacity[word], integer_depth);
        }
        return;
    }
    let behind = depth - f32(atomicLoad(&opacity[word])) / DEPTH_SCALE;
    let layer_index = u32(layer_at(behind));
    if (layer_index < HAIR_LAYERS) { // strands behind all layers are on the other side of the head
        atomicAdd(&opacity[word + 1u + layer_index], u32(cover * COVER_SCALE + 0.5));
    }
}
