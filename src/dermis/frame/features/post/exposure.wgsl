// The factor from radiance to the picture: given, or metered by meter_key.wgsl.

@group(0) @binding(41) var<storage, read> metered: array<f32>;

// given: 0 for the meter's
fn exposure_of(given: f32) -> f32 {
    return select(given, metered[0], given == 0.0);
}
