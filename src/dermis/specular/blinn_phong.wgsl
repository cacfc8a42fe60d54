// Blinn-Phong lobes: normalised [Walter2007], and original [Blinn1977], divided by the cosine that the caller applies.
//#include "cosines.wgsl"
//#include "fresnel.wgsl"

// Exponent of the lobe as wide as a Beckmann lobe of roughness m [Walter2007].
fn exponent(m: f32) -> f32 {
    return 2.0 / (m * m) - 2.0;
}

// log(1 + t), accurate for small t.
fn log_of_one_plus(t: f32) -> f32 {
    let y = t / (2.0 + t);
    let y2 = y * y;
    let series = 2.0 * y * (1.0 + y2 * (1.0 / 3.0 + y2 * (0.2 + y2 / 7.0)));
    return select(log(1.0 + t), series, t < 0.5);
}

fn power_of_n_h(a: Angles, s: f32) -> f32 {
    return exp(-0.5 * s * log_of_one_plus(a.tan2_h));
}

fn blinn_phong(a: Angles, m: f32) -> f32 {
    let s = exponent(m);
    return fresnel(a.v_h) * (s + 2.0) / (8.0 * PI) * power_of_n_h(a, s);
}

fn blinn_phong_plain(a: Angles, m: f32) -> f32 {
    return fresnel(a.v_h) * power_of_n_h(a, exponent(m)) / (PI * a.n_l);
}
