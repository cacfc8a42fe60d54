// Two unit vectors that are orthogonal to a given unit vector and to each other. Source: [Duff2017].

fn beside(w: vec3f) -> mat2x3f {
    let s = select(-1.0, 1.0, w.z >= 0.0);
    let a = -1.0 / (s + w.z);
    let b = w.x * w.y * a;
    return mat2x3f(vec3f(1.0 + s * w.x * w.x * a, s * b, -s * w.x), vec3f(b, s + w.y * w.y * a, -w.y));
}
