// Beckmann's distribution of slopes without its 1/pi, exp(-tan^2 / m^2) / (m^2 cos^4): computed, or by table.

fn beckmann(a: Angles, m: f32) -> f32 {
    let m2 = m * m;
    let sec2 = 1.0 + a.tan2_h;
    return exp(-a.tan2_h / m2) * sec2 * sec2 / m2;
}

// From the table that holds half its tenth root. Source: [dEonLuebke2007].
fn beckmann_by_table(cos_h: f32, m: f32) -> f32 {
    let columns = f32(textureDimensions(beckmann_table).x); // the first is cos_h = 0, the last 1
    let t = 2.0 * load_bilinear(beckmann_table, vec2f((cos_h * (columns - 1.0) + 0.5) / columns, m)).x;
    let t2 = t * t;
    let t4 = t2 * t2;
    return t4 * t4 * t2;
}
