// Cosines between normal n, light l, view v and half vector h, for all lobes.

const GRAZING: f32 = 1e-6;

struct Angles {
    n_l: f32, // cosines
    n_v: f32,
    n_h: f32,
    v_h: f32,
    tan2_h: f32, // tan^2 between n and h, from a cross product, as 1 - n_h^2 cancels at the peak
}

fn angles_between(n: vec3f, l: vec3f, v: vec3f) -> Angles {
    let h = l + v;
    let scale = inverseSqrt(max(dot(h, h), 1e-12));
    let n_h = dot(n, h) * scale;
    let across = cross(n, h) * scale;
    let tan2_h = dot(across, across) / max(n_h * n_h, 1e-12);
    return Angles(max(dot(n, l), GRAZING), max(dot(n, v), GRAZING), n_h, dot(v, h) * scale, tan2_h);
}
