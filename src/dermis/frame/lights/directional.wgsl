// Parallel light of constant irradiance.

fn directional_incident(light: Light, p: vec3f, part: u32) -> Incident {
    return Incident(-light.direction, light.irradiance);
}
