// Blend weights of two profiles in one float, 12 bits each.

const MAX_WEIGHT: f32 = 4095.0;

fn packed_weights(weights: vec2f) -> f32 {
    let levels = round(MAX_WEIGHT * saturate(weights));
    return levels.x + (MAX_WEIGHT + 1.0) * levels.y;
}

fn unpacked_weights(packed: f32) -> vec2f {
    let y = floor(packed / (MAX_WEIGHT + 1.0));
    return vec2f(packed - (MAX_WEIGHT + 1.0) * y, y) / MAX_WEIGHT;
}
