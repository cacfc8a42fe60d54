// Two Kelemen lobes of two roughnesses, as engines shade skin [EpicGames2025].
//#include "kelemen.wgsl"

// factors of the roughness
//#fill const NARROW: f32 = {narrow};
//#fill const WIDE: f32 = {wide};
//#fill const SHARE_OF_NARROW: f32 = {share_of_narrow};

fn two_lobe(a: Angles, m: f32) -> f32 {
    let slopes = mix(beckmann(a, clamp(WIDE * m, 0.05, 1.0)), beckmann(a, clamp(NARROW * m, 0.05, 1.0)), SHARE_OF_NARROW);
    return slopes * fresnel(a.v_h) / (4.0 * PI * max(a.v_h * a.v_h, 1e-12));
}
