// Point light, whose irradiance falls with the square of the distance.

fn point_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let d = light.position - p;
    let d2 = max(dot(d, d), 1.0);
    return Incident(d * inverseSqrt(d2), light.irradiance * light.reference_mm * light.reference_mm / d2);
}
