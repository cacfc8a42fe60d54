// An eye as light finds it: the white, the iris seen through the cornea, the film of tears over both.
//#include "irradiance/lighting.wgsl"
//#include "surface/eye_colours.wgsl"

// The white scatters light over some mm, and lids that touch it do so too: shadows are those of a point above it.
const SCATTERED_MM: f32 = 0.5;
const SCATTERED: vec3f = vec3f(0.32, 0.28, 0.26); // share of a light that comes into such a shadow, through lids and white
// Artist's values: what the lids, which lie close, keep of the light from all around.
const UPPER_SHADE: vec3f = vec3f(0.58, 0.68, 0.72); // they give red back
const UPPER_SHADE_MM: f32 = 2.2;
const LOWER_SHADE: vec3f = vec3f(0.28, 0.36, 0.40);
const LOWER_SHADE_MM: f32 = 1.3;
const MENISCUS: f32 = 1.1; // how steep tears rise to the lower lid
const MENISCUS_ROUGHNESS: f32 = 0.16; // over its curve, which is finer than pixels
const MENISCUS_FROM_MM: f32 = 0.15; // from its edge, within which it lies on the eye
const MENISCUS_TO_MM: f32 = 0.6;
const TEARS: f32 = 0.06; // roughness of their film

// Distances from the edges of the lids [mm], and the way from the lower one, unit.
struct Lids {
    above: f32,
    below: f32,
    from_below: vec3f,
}

struct EyeLit {
    surface: Surface, // whose normal is that of what lies below the film
    film: Film,
}

// Share of the light that lids leave.
fn lid_shade(lids: Lids) -> vec3f {
    let upper = UPPER_SHADE * exp(-pow(lids.above / UPPER_SHADE_MM, 2.0));
    let lower = LOWER_SHADE * exp(-pow(lids.below / LOWER_SHADE_MM, 2.0));
    return (1.0 - upper) * (1.0 - lower);
}

// How much a place belongs to the tears along the lower lid.
fn meniscus_at(lids: Lids) -> f32 {
    let lies = 1.0 - smoothstep(MENISCUS_FROM_MM, MENISCUS_TO_MM, lids.below);
    return lies * smoothstep(0.3, 2.0, lids.above); // it runs out towards the corners
}

// The surface of the tears: along the lower lid they rise to it in a curve.
fn tears_at(smooth_film: vec3f, lids: Lids) -> vec3f {
    return normalize(smooth_film + MENISCUS * meniscus_at(lids) * lids.from_below);
}

// p: in its own space; v: towards the viewer
fn eye_at(eye: Eye, p: vec3f, lids: Lids, v: vec3f) -> EyeLit {
    let turned = mat3x3f(eye.to_own[0].xyz, eye.to_own[1].xyz, eye.to_own[2].xyz);
    let d = normalize(turned * -v);
    let clear = clear_at(p);
    let ball = normalize(p - vec3f(0.0, 0.0, eye.middle_mm));
    let cornea = normalize(p - vec3f(0.0, 0.0, CORNEA_AT));
    let on_iris = on_iris_at(seen_on_iris(p, d));
    let film = tears_at(normalize(mix(ball, cornea, clear)), lids);
    // the white scatters light around its curve
    let below = normalize(mix(ball + vec3f(0.0, 0.0, AROUND), gathered_at(on_iris), clear));
    let colour = mix(white_colour(eye, p), UNDER_WATER * iris_colour(eye, on_iris), clear) * lid_shade(lids);
    let back = transpose(turned); // a turn and a scale: normals come back by it
    let film_roughness = mix(TEARS, MENISCUS_ROUGHNESS, meniscus_at(lids));
    return EyeLit(Surface(normalize(back * below), colour, film_roughness, 1.0), Film(normalize(back * film), SCATTERED));
}
