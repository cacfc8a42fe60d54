// Shares of two profiles in one float, 12 bits each.

const SHARE_LEVELS: f32 = 4095.0;

fn packed_shares(shares: vec2f) -> f32 {
    let levels = round(SHARE_LEVELS * saturate(shares));
    return levels.x + (SHARE_LEVELS + 1.0) * levels.y;
}

fn unpacked_shares(packed: f32) -> vec2f {
    let y = floor(packed / (SHARE_LEVELS + 1.0));
    return vec2f(packed - (SHARE_LEVELS + 1.0) * y, y) / SHARE_LEVELS;
}
