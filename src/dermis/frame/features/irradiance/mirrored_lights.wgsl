// Area lights mirrored by a smooth film, such as tears.
//#include "lights.wgsl"

override EYES: bool = false; // whether there are modelled eyes and teeth

const MIRROR_BLUR: f32 = 0.06; // angle over which the edge of a mirrored light fades [rad]

// Radiance of a light in a direction r from p, with soft edges; the parts of a divided light add up to the whole.
fn mirrored_radiance(light: Light, p: vec3f, r: vec3f) -> vec3f {
    if (light.punctual != 0u) {
        return vec3f(0.0);
    }
    let d = light.position - p;
    if (light.round != 0u) {
        let along = max(dot(d, r), 1.0);
        return light.irradiance * covered(length(d - along * r), length(light.half_u), along) * step(0.0, dot(d, r));
    }
    let facing = -dot(r, light.direction);
    let far = -dot(d, light.direction) / max(facing, 1e-3);
    if (facing <= 0.0 || far <= 0.0) {
        return vec3f(0.0);
    }
    let off = far * r - d;
    let u = length(light.half_u);
    let v = length(light.half_v);
    let inside = covered(dot(off, light.half_u) / u, u, far) * covered(dot(off, light.half_v) / v, v, far);
    return light.irradiance * inside;
}

// Coverage at a distance from the middle of a light, whose edge fades over the blur [mm].
fn covered(off: f32, half_side: f32, far: f32) -> f32 {
    return saturate(0.5 + (half_side - abs(off)) / (MIRROR_BLUR * far));
}
