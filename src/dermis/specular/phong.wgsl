// Phong lobes: normalised [LafortuneWillems1994], and original [Phong1975], divided by the cosine of the light.
//#include "blinn_phong.wgsl"

fn power_of_r_v(a: Angles, s: f32) -> f32 {
    let r_v = 2.0 * a.n_l * a.n_v - (2.0 * a.v_h * a.v_h - 1.0);
    return select(0.0, pow(max(r_v, GRAZING), s), r_v > 0.0);
}

fn phong(a: Angles, m: f32) -> f32 {
    let s = 0.25 * exponent(m);
    return fresnel(a.v_h) * (s + 2.0) / (2.0 * PI) * power_of_r_v(a, s);
}

fn phong_plain(a: Angles, m: f32) -> f32 {
    return fresnel(a.n_l) * power_of_r_v(a, 0.25 * exponent(m)) / (PI * a.n_l);
}
