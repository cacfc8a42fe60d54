// The rough white surface over the skin: Kelemen/Szirmay-Kalos with Schlick's Fresnel and a Beckmann table.

fn schlick(cos_theta: f32, f0: f32) -> f32 {
    let c = clamp(1.0 - cos_theta, 0.0, 1.0);
    let c2 = c * c;
    return f0 + (1.0 - f0) * c2 * c2 * c;
}

// exp(-tan^2 / m^2) / (m^2 cos^4), from the table that holds half its tenth root.
fn beckmann(cos_h: f32, m: f32) -> f32 {
    let columns = f32(textureDimensions(beckmann_table).x); // the first is cos_h = 0, the last 1
    let t = 2.0 * load_bilinear(beckmann_table, vec2f((cos_h * (columns - 1.0) + 0.5) / columns, m)).x;
    let t2 = t * t;
    let t4 = t2 * t2;
    return t4 * t4 * t2;
}

// BRDF for rho_s = 1, without the cosine [1/sr]. Source: [Kelemen2001], divided by pi.
fn kelemen(n: vec3f, l: vec3f, v: vec3f, m: f32, f0: f32) -> f32 {
    let h = l + v;
    let h2 = max(dot(h, h), 1e-12);
    let unit = h * inverseSqrt(h2);
    let cos_h = dot(n, unit);
    if (cos_h <= 0.0) {
        return 0.0;
    }
    return beckmann(cos_h, m) * schlick(dot(v, unit), f0) / (PI * h2);
}

// Share of light from (or to) a direction that the surface reflects, for rho_s = 1.
fn surface_albedo(cos_theta: f32, m: f32) -> f32 {
    return load_bilinear(albedo_table, vec2f(cos_theta, m)).x;
}

// Share of light that enters, or leaves, the skin in a direction.
fn passes(cos_theta: f32, m: f32, rho_s: f32) -> f32 {
    return max(0.0, 1.0 - rho_s * surface_albedo(max(cos_theta, 0.0), m));
}
