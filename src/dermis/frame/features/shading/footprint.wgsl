// How much of the maps a part of the picture shows.

const FINEST_RATIO: f32 = 4.0; // longest over shortest side of a footprint that one map sample may cover

// Side of what is filtered, from its sides in uv to the right and down.
fn footprint_of(across: vec2f, down: vec2f) -> f32 {
    let x = length(across);
    let y = length(down);
    return max(min(x, y), max(x, y) / FINEST_RATIO);
}
