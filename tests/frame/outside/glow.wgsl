// A point that shines with a power of the cosine from its direction; `cos_inner` holds the power.

fn after_glow_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let all = point_incident(light, p, part);
    let cosine = max(dot(-all.direction, light.direction), 0.0);
    return Incident(all.direction, all.irradiance * pow(cosine, light.cos_inner));
}
