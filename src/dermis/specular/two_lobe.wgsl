// Two-lobe model of game engines [EpicGames2025]: two Beckmann distributions with Smith masking [Smith1967].
//#include "torrance_sparrow.wgsl"

// Factors of the roughness, and weight of the narrow lobe.
//#fill const NARROW_FACTOR: f32 = {narrow};
//#fill const WIDE_FACTOR: f32 = {wide};
//#fill const NARROW_WEIGHT: f32 = {narrow_weight};

fn two_lobe(a: Angles, m: f32) -> f32 {
    let narrow = clamp(NARROW_FACTOR * m, 0.05, 1.0);
    let wide = clamp(WIDE_FACTOR * m, 0.05, 1.0);
    let slopes = mix(beckmann(a, wide), beckmann(a, narrow), NARROW_WEIGHT);
    // Masking is an integral over slopes, so projected areas are mixed like the distributions.
    let to_light = mix(smith_area(a.n_l, wide), smith_area(a.n_l, narrow), NARROW_WEIGHT);
    let to_eye = mix(smith_area(a.n_v, wide), smith_area(a.n_v, narrow), NARROW_WEIGHT);
    return slopes * fresnel(a.v_h) / (4.0 * PI * to_light * to_eye);
}
