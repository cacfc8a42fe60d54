// Uniform rectangle, divided into parts that are each replaced by a Lambertian point light at the centre of the part.

fn rectangle_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let position = part_centre(part, light.side);
    let d = light.position + position.x * light.half_u + position.y * light.half_v - p;
    let d2 = max(dot(d, d), 1.0);
    let l = d * inverseSqrt(d2);
    let area = 4.0 * length(light.half_u) * length(light.half_v) / f32(parts_of(light));
    return Incident(l, light.irradiance * max(0.0, -dot(l, light.direction)) * area / d2);
}
