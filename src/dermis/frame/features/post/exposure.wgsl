// Exposure, the factor from radiance to the picture: fixed, or metered by meter_key.wgsl.

@group(0) @binding(41) var<storage, read> metered: array<f32>;

// fixed: 0 for the metered exposure
fn exposure_of(fixed: f32) -> f32 {
    return select(fixed, metered[0], fixed == 0.0);
}
