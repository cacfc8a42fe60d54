// Area of the maps that a part of the picture covers.

const FINEST_RATIO: f32 = 4.0; // largest ratio of the sides of a footprint that one map sample covers

// Side of the filter, from the steps of the footprint in uv to the right and down.
fn footprint_of(across: vec2f, down: vec2f) -> f32 {
    let x = length(across);
    let y = length(down);
    return max(min(x, y), max(x, y) / FINEST_RATIO);
}
