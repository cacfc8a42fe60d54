// Beckmann distribution without its 1/pi, exp(-tan^2 / m^2) / (m^2 cos^4), evaluated directly or from a table.

fn beckmann(a: Angles, m: f32) -> f32 {
    let m2 = m * m;
    let sec2 = 1.0 + a.tan2_h;
    return exp(-a.tan2_h / m2) * sec2 * sec2 / m2;
}

// Value from the table, which stores half of the tenth root. Source: [dEonLuebke2007].
fn beckmann_by_table(cos_h: f32, m: f32) -> f32 {
    let size = vec2f(textureDimensions(beckmann_table)); // columns are cos_h from 0 to 1 inclusive
    let position = vec2f(cos_h * (size.x - 1.0), m * size.y - 0.5);
    let quad = textureGather(0, beckmann_table, nearest_sampler, (floor(position) + 1.0) / size);
    let t = 2.0 * dot(gather_weights(position), quad);
    let t2 = t * t;
    let t4 = t2 * t2;
    return t4 * t4 * t2;
}
