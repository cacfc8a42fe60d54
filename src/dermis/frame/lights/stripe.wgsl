// A sheet of parallel light: a Gaussian across it, 1/e^2 at its edges; even along it.

fn stripe_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let d = p - light.position;
    let across = dot(d, light.half_u);
    let share = exp(-2.0 * across * across) * (1.0 - smoothstep(0.95, 1.0, abs(dot(d, light.half_v))));
    return Incident(-light.direction, light.irradiance * share);
}
