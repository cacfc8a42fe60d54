// Sheet of parallel light: its irradiance is constant along the sheet, and a Gaussian across it, which is 1/e^2 at the edges.

const STRIPE_VARIANCE: f32 = 0.25; // relative to the square of the half width

// Irradiance at a distance from the centre [half widths] relative to the centre, blurred by a Gaussian of variance `added`.
fn stripe_across(distance: f32, added: f32) -> f32 {
    let variance = STRIPE_VARIANCE + added;
    return sqrt(STRIPE_VARIANCE / variance) * exp(-0.5 * distance * distance / variance);
}

fn stripe_along(light: Light, p: vec3f) -> f32 {
    return 1.0 - smoothstep(0.95, 1.0, abs(dot(p - light.position, light.half_v)));
}

fn stripe_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let across = stripe_across(dot(p - light.position, light.half_u), area_variance(light.half_u));
    return Incident(-light.direction, light.irradiance * (across * stripe_along(light, p)));
}
