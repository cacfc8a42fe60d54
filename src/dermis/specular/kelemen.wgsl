// Kelemen and Szirmay-Kalos lobe, divided by pi, with and without a table. Source: [Kelemen2001].
//#include "beckmann.wgsl"
//#include "cosines.wgsl"
//#include "fresnel.wgsl"

fn kelemen(a: Angles, m: f32) -> f32 {
    return beckmann_by_table(a.n_h, m) * fresnel(a.v_h) / (4.0 * PI * max(a.v_h * a.v_h, 1e-12));
}

fn kelemen_direct(a: Angles, m: f32) -> f32 {
    return beckmann(a, m) * fresnel(a.v_h) / (4.0 * PI * max(a.v_h * a.v_h, 1e-12));
}
