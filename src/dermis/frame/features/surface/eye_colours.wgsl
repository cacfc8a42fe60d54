// Colours of an eye: the sclera, and the iris seen through the cornea.
//#include "shape/eyeball.wgsl"

//#fill const IRIS_AT: f32 = {iris_at}; // plane of the iris on the axis [mm]

const EYE_ETA: f32 = 1.336; // of the cornea and the aqueous humour as one medium
//#fill const IRIS_MM: f32 = {iris_mm}; // radius
// Radiance of a diffuse disc under the cornea: light that leaves the medium spreads over a solid angle larger by the squared
// index, and the cornea concentrates incident light on the iris.
const FOCUS_MM: f32 = EYE_ETA * CORNEA_MM / (EYE_ETA - 1.0); // behind the apex
const FOCUSED_WIDTH: f32 = 1.0 - (CORNEA_AT + CORNEA_MM - IRIS_AT) / FOCUS_MM; // width of a beam on the iris relative to its width outside
const IRIS_FACTOR: f32 = 1.0 / (EYE_ETA * EYE_ETA * FOCUSED_WIDTH * FOCUSED_WIDTH);
const LIMBUS_SOFT_MM: f32 = 0.55; // half of the width over which the sclera becomes transparent
// Artistic values, linear.
const STROMA: vec3f = vec3f(0.20, 0.27, 0.33); // without pigment; scattering makes it blue
const PIGMENT: vec3f = vec3f(0.085, 0.040, 0.018); // of eumelanin
const WHITE: vec3f = vec3f(0.52, 0.465, 0.435);
const VESSEL: vec3f = vec3f(0.62, 0.20, 0.17);

struct Eye {
    to_own: mat4x4f, // from head space to the space of the eye, in mm of an average eye with z along its axis
    material: u32,
    eumelanin: f32,
    pupil_mm: f32,
    redness: f32,
    seed: f32,
    middle_mm: f32, // position of the centre of the eyeball on the axis: 0 for an average eye
}

// Random numbers at integer points of the plane, and smooth noise between them.
fn eye_random(cell: vec2f, seed: f32) -> f32 {
    return fract(sin(dot(cell, vec2f(127.1, 311.7)) + 17.3 * seed) * 43758.5453);
}

fn eye_noise(position: vec2f, seed: f32) -> f32 {
    let cell = floor(position);
    let t = (position - cell) * (position - cell) * (3.0 - 2.0 * (position - cell));
    let near = mix(eye_random(cell, seed), eye_random(cell + vec2f(1.0, 0.0), seed), t.x);
    let far = mix(eye_random(cell + vec2f(0.0, 1.0), seed), eye_random(cell + vec2f(1.0, 1.0), seed), t.x);
    return mix(near, far, t.y);
}

// Noise around the axis, periodic in the angle.
fn around_axis(turn: f32, fibres: f32, radius: f32, along: f32, seed: f32) -> f32 {
    let position = turn / 6.2831853 * fibres;
    let back = position - fibres;
    let share = smoothstep(0.75, 1.0, turn / 6.2831853);
    return mix(eye_noise(vec2f(position, radius * along), seed), eye_noise(vec2f(back, radius * along), seed), share);
}

// Point of the iris plane, relative to the axis [mm], that is visible through the cornea at p along the view direction d.
fn refracted_to_iris(p: vec3f, d: vec3f) -> vec2f {
    let n = normalize(p - vec3f(0.0, 0.0, CORNEA_AT));
    let inside = refract(d, n, 1.0 / EYE_ETA);
    let far = (IRIS_AT - p.z) / min(inside.z, -0.05);
    return p.xy + max(far, 0.0) * inside.xy;
}

// Colour of the iris at a point of its plane: fibres of the stroma over a dark background, with pigment.
fn iris_colour(eye: Eye, q: vec2f) -> vec3f {
    let r = length(q);
    let turn = atan2(q.y, q.x) + 3.14159265;
    let share = clamp((r - eye.pupil_mm) / (IRIS_MM - eye.pupil_mm), 0.0, 1.0);
    let wave = 0.35 * (around_axis(turn, 9.0, r, 0.4, eye.seed + 3.0) - 0.5);
    let fine = around_axis(turn, 110.0, share, 2.2, eye.seed);
    let coarse = around_axis(turn, 38.0, share, 3.0, eye.seed + 1.0);
    let crypts = smoothstep(0.62, 0.85, around_axis(turn, 17.0, share, 5.0, eye.seed + 2.0));
    let fibres = 0.30 + 0.75 * fine * fine + 0.55 * coarse * coarse;
    let collarette = exp(-pow((share - 0.30 - 0.25 * wave) / 0.10, 2.0));
    let ruff = smoothstep(0.0, 0.06, share);
    let rim = 1.0 - 0.85 * smoothstep(0.80, 1.0, r / IRIS_MM + 0.06 * wave);
    let patches = around_axis(turn, 7.0, share, 1.6, eye.seed + 4.0);
    // pigment concentrates around the pupil
    let inner = 1.2 * exp(-pow(share / 0.42, 2.0));
    let pigment = eye.eumelanin * (0.55 + 0.9 * patches + inner) + 0.10 * inner;
    let hidden = 1.0 - exp(-2.6 * pigment * max(eye.eumelanin, 0.15));
    var colour = mix(STROMA * mix(1.0, 0.75, eye.eumelanin), PIGMENT * (1.0 + 2.2 * (1.0 - eye.eumelanin)), hidden);
    colour *= fibres * (1.0 + 0.5 * collarette) * (1.0 - 0.45 * crypts * (1.0 - 0.5 * eye.eumelanin)) * rim;
    let open = smoothstep(eye.pupil_mm - 0.06, eye.pupil_mm + 0.10, r + 0.12 * wave);
    return mix(vec3f(0.0015), colour * mix(0.35, 1.0, ruff), open);
}

// Colour of the sclera at a point of the eyeball, with vessels towards its sides.
fn white_colour(eye: Eye, p: vec3f) -> vec3f {
    let off = length(p.xy);
    let aside = smoothstep(6.5, 11.5, off);
    let turn = atan2(p.y, p.x);
    let bent = off + 1.3 * eye_noise(p.xy * 0.9, eye.seed + 7.0);
    let winding = vec2f(eye_noise(p.xy * 2.1, eye.seed + 8.0), eye_noise(p.xy * 2.1, eye.seed + 9.0)) - 0.5;
    let place = vec2f(turn, bent) + vec2f(0.16, 1.6) * winding;
    let line = abs(eye_noise(place * vec2f(7.0, 0.5), eye.seed + 5.0) - 0.5);
    let fine = abs(eye_noise(place * vec2f(17.0, 0.8), eye.seed + 6.0) - 0.5);
    let presence = smoothstep(0.35, 0.75, eye_noise(vec2f(turn * 4.0, bent * 0.4), eye.seed + 10.0));
    let thin = 0.5 + 0.5 * smoothstep(7.0, 12.0, off); // vessels are thinner and fainter near the limbus
    let vessels = presence * (1.0 - smoothstep(0.02, 0.11 * thin, line)) + 0.55 * (1.0 - smoothstep(0.02, 0.12 * thin, fine));
    let red = (0.2 + eye.redness) * (0.16 * aside + 1.1 * thin * vessels * smoothstep(6.2, 8.2, off));
    let uneven = 1.0 + 0.09 * (eye_noise(p.xy * 0.55, eye.seed + 11.0) - 0.5);
    let yellow = mix(vec3f(1.0), vec3f(0.96, 0.89, 0.79), aside);
    return mix(WHITE * yellow * uneven, VESSEL, clamp(red, 0.0, 0.8));
}

// Transparency of the surface of the eye at a point: 1 in the cornea, 0 in the sclera.
fn clearness(p: vec3f) -> f32 {
    return (1.0 - smoothstep(LIMBUS_MM - LIMBUS_SOFT_MM, LIMBUS_MM + LIMBUS_SOFT_MM, length(p.xy))) * step(0.0, p.z);
}

// Point of the iris plane, clamped to the iris.
fn clamped_to_iris(q: vec2f) -> vec2f {
    return q * min(1.0, IRIS_MM / max(length(q), 1e-3));
}
