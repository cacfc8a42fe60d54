// Torrance-Sparrow microfacet lobes with V-cavity masking [TorranceSparrow1967] or Smith masking [Smith1967].
//#include "beckmann.wgsl"
//#include "cosines.wgsl"
//#include "fresnel.wgsl"

const ROOT_PI: f32 = 1.77245385;

fn torrance_sparrow(a: Angles, m: f32) -> f32 {
    // min(1, 2 n.h min(n.l, n.v) / v.h) / (4 n.l n.v)
    let groove = a.n_h / (2.0 * max(a.v_h, GRAZING) * max(a.n_l, a.n_v));
    return beckmann(a, m) * fresnel(a.v_h) / PI * min(0.25 / (a.n_l * a.n_v), groove);
}

fn torrance_sparrow_smith(a: Angles, m: f32) -> f32 {
    return beckmann(a, m) * fresnel(a.v_h) / (4.0 * PI * smith_area(a.n_l, m) * smith_area(a.n_v, m));
}

// c / G1(c), the projected area of all facets without masking, exact except for erf, which has an error of 2e-7
// [AbramowitzStegun1964] 7.1.26.
fn smith_area(c: f32, m: f32) -> f32 {
    let across = m * sqrt(max(1.0 - c * c, 1e-12));
    let x = c / across;
    let bell = exp(-x * x);
    let t = 1.0 / (1.0 + 0.3275911 * x);
    let tail = ((((1.061405429 * t - 1.453152027) * t + 1.421413741) * t - 0.284496736) * t + 0.254829592) * t * bell;
    return 0.5 * (c * (2.0 - tail) + bell * across / ROOT_PI);
}
