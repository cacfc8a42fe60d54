// Uniform sphere, sampled by directions of equal projected solid angle in the cone of the sphere; the concentric map from the
// square to the disc distributes them [ShirleyChiu1997]. The total irradiance is exact for surfaces that see the whole sphere.

fn sphere_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let d = light.position - p;
    let sine2 = clamp(dot(light.half_u, light.half_u) / max(dot(d, d), 1e-6), 0.0, 1.0);
    let position = part_centre(part, light.side);
    let steep = abs(position.x) <= abs(position.y);
    let r = select(position.x, position.y, steep);
    let turn = 0.25 * PI * select(position.y / position.x, position.x / position.y, steep);
    let phi = select(turn, 0.5 * PI - turn, steep);
    let sine = r * sqrt(sine2);
    let cosine = sqrt(1.0 - sine * sine);
    let w = normalize(d);
    let axes = beside(w);
    let l = sine * (cos(phi) * axes[0] + sin(phi) * axes[1]) + cosine * w;
    return Incident(l, light.irradiance * (PI * sine2 / (cosine * f32(parts_of(light)))));
}
