// A uniform sphere: directions of equal projected solid angle in its cone, from the concentric map of the square to the
// disc [ShirleyChiu1997]. Together they light any surface that sees all of the sphere as much as the sphere does.

fn sphere_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let d = light.position - p;
    let sine2 = clamp(dot(light.half_u, light.half_u) / max(dot(d, d), 1e-6), 0.0, 1.0);
    let place = place_of(part, light.side);
    let steep = abs(place.x) <= abs(place.y);
    let r = select(place.x, place.y, steep);
    let turn = 0.25 * PI * select(place.y / place.x, place.x / place.y, steep);
    let phi = select(turn, 0.5 * PI - turn, steep);
    let sine = r * sqrt(sine2);
    let cosine = sqrt(1.0 - sine * sine);
    let w = normalize(d);
    let axes = beside(w);
    let l = sine * (cos(phi) * axes[0] + sin(phi) * axes[1]) + cosine * w;
    return Incident(l, light.irradiance * (PI * sine2 / (cosine * f32(parts_of(light)))));
}
