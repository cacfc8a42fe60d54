// Clears the deep opacity maps of all lights, the grid of the sky, and their bounds.
//#include "shape/geometry.wgsl"
//#include "surface/surface.wgsl"
//#include "strand_window.wgsl"

@group(0) @binding(31) var<storage, read_write> windows: array<u32>; // see strand_window.wgsl

const LANES: u32 = 256u;

// Initial value of a word of the buffer.
fn initial_word(word: u32) -> u32 {
    if (word < sky_words()) {
        return select(0u, ~0u, word < 3u); // empty bounds: high below low
    }
    return empty_word((word - sky_words()) % (first_word(1) - first_word(0)));
}

// Initial value of a word of a light's map.
fn empty_word(word: u32) -> u32 {
    if (word >= WINDOW_HEAD) {
        return select(0u, NO_HAIR, (word - WINDOW_HEAD) % TEXEL_WORDS == 0u);
    }
    return select(0u, ~0u, word < 3u); // empty bounds: high below low
}

@compute @workgroup_size(LANES)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var word = id.x; word < arrayLength(&windows); word += groups.x * LANES) {
        windows[word] = initial_word(word);
    }
}
