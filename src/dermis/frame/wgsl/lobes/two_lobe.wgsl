// Two Kelemen lobes of two roughnesses, as engines shade skin [EpicGames2025]; numbers as in specular/two_lobe.py.
//#include "lobes/kelemen.wgsl"

const NARROW: f32 = 0.5625; // factors of the roughness
const WIDE: f32 = 1.69;
const SHARE_OF_NARROW: f32 = 0.85;

fn two_lobe(a: Angles, m: f32) -> f32 {
    let slopes = mix(beckmann(a, clamp(WIDE * m, 0.05, 1.0)), beckmann(a, clamp(NARROW * m, 0.05, 1.0)), SHARE_OF_NARROW);
    return slopes * fresnel(a.v_h) / (4.0 * PI * max(a.v_h * a.v_h, 1e-12));
}
