// Sheen of cloth: upright fibres scatter light at grazing angles [EstevezKulla2017].

const SHEEN_ROUGHNESS: f32 = 0.4;
const SHEEN_UNIFORM: f32 = 0.35; // albedo of the lobe for uniform light at grazing exit

var<private> sheen: vec3f; // strength of the lobe

// Radiance towards v per irradiance on a plane across the light, whose cosine of incidence is `cosine`.
fn sheen_lobe(n: vec3f, l: vec3f, v: vec3f, cosine: f32) -> vec3f {
    let half_cosine = clamp(dot(n, normalize(l + v)), 0.0, 1.0);
    let facing = max(dot(n, v), 0.05);
    let sine = sqrt(max(1.0 - half_cosine * half_cosine, 0.0));
    let distribution = (2.0 + 1.0 / SHEEN_ROUGHNESS) * pow(sine, 1.0 / SHEEN_ROUGHNESS) / (2.0 * PI);
    return sheen * (cosine * distribution / (4.0 * (cosine + facing - cosine * facing)));
}

// Radiance towards v per uniform irradiance.
fn sheen_of_uniform(n: vec3f, v: vec3f) -> vec3f {
    let grazing = 1.0 - clamp(dot(n, v), 0.0, 1.0);
    return sheen * (SHEEN_UNIFORM * grazing * grazing * grazing / PI);
}
