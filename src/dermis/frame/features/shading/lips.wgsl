// Fraction of the sky that a point behind the lips sees through the opening between them. `shade.lips` stores the edge of the opening.

const LIP_POINTS: u32 = 38u; // points of the edge, from the middle of the upper lip
const LIP_CORNER: f32 = 9.0; // index of the left corner

// Direction from p to a point of the edge; below the horizon of the normal n, the direction of the horizon next to it.
// teeth: from the upper lip to the edge of the teeth that hide the opening, in the middle [mm]
fn lip_direction(index: u32, p: vec3f, n: vec3f, teeth: vec3f) -> vec3f {
    let from_middle = min(f32(index), f32(LIP_POINTS - index));
    let d = shade.lips[index].xyz + max(1.0 - from_middle / LIP_CORNER, 0.0) * teeth - p;
    return normalize(d - min(dot(d, n), 0.0) * n + vec3f(0.0, 0.0, 1e-6));
}

// Fraction of the irradiance by a uniform sky: the form factor of the polygon, which is clockwise as seen from outside.
// of_mesh: result if the edge is unknown
fn open_between_lips(p: vec3f, n: vec3f, teeth: vec3f, of_mesh: f32) -> f32 {
    let known = select(0u, LIP_POINTS, shade.lips[0].w > 0.0);
    var a = lip_direction(LIP_POINTS - 1u, p, n, teeth);
    var sum = 0.0;
    var i = 0u;
    loop {
        if (i >= known) {
            break;
        }
        let b = lip_direction(i, p, n, teeth);
        let c = cross(a, b);
        sum += acos(clamp(dot(a, b), -1.0, 1.0)) * dot(n, c) / max(length(c), 1e-9);
        a = b;
        i++;
    }
    return select(of_mesh, saturate(-sum / (2.0 * PI)), known > 0u);
}
