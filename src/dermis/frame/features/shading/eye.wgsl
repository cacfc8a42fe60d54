// Surface of an eye: the white, the iris seen through the cornea, and the tear film over both.
//#include "irradiance/lighting.wgsl"
//#include "surface/eye_colours.wgsl"

// The white and the lids scatter light over some mm, so shadows are evaluated at a point above the surface.
const SHADOW_OFFSET_MM: f32 = 0.5;
const LIT_LIDS: f32 = 0.5; // fraction of the lids around a shadow on the eye that a light reaches
// Artistic values: fraction of ambient light that the lids absorb.
const UPPER_SHADE: vec3f = vec3f(0.58, 0.68, 0.72); // lids reflect red light
const UPPER_SHADE_MM: f32 = 2.8;
const LOWER_SHADE: vec3f = vec3f(0.28, 0.36, 0.40);
const LOWER_SHADE_MM: f32 = 1.3;
const MENISCUS: f32 = 0.8; // slope of the tears at the lower lid
const MENISCUS_ROUGHNESS: f32 = 0.22; // roughness by its curve, which is finer than pixels
const MENISCUS_FROM_MM: f32 = 0.15; // distance from the edge of the lid, where the meniscus starts to fade
const MENISCUS_TO_MM: f32 = 0.6;
const TEARS: f32 = 0.06; // roughness of the tear film

// Distances from the edges of the lids [mm], and unit direction from the lower one.
struct Lids {
    above: f32,
    below: f32,
    from_below: vec3f,
}

struct EyeLit {
    surface: Surface, // below the film
    film: Film,
}

// Fraction of ambient light that the lids let pass.
fn lid_transmittance(lids: Lids) -> vec3f {
    let upper = UPPER_SHADE * exp(-pow(lids.above / UPPER_SHADE_MM, 2.0));
    let lower = LOWER_SHADE * exp(-pow(lids.below / LOWER_SHADE_MM, 2.0));
    return (1.0 - upper) * (1.0 - lower);
}

// Weight of the meniscus of tears along the lower lid.
fn meniscus_weight(lids: Lids) -> f32 {
    let at_lid = 1.0 - smoothstep(MENISCUS_FROM_MM, MENISCUS_TO_MM, lids.below);
    return at_lid * smoothstep(0.3, 2.0, lids.above); // it ends at the corners
}

// Normal of the tears, which rise in a curve along the lower lid.
fn tears_at(smooth_film: vec3f, lids: Lids) -> vec3f {
    return normalize(smooth_film + MENISCUS * meniscus_weight(lids) * lids.from_below);
}

// Ambient light is hidden by the lids; lights have shadows, into which lids reflect light.
// p: position in the space of the eye; v: direction to the viewer; lid_albedo: of skin
fn eye_at(eye: Eye, p: vec3f, lids: Lids, v: vec3f, lid_albedo: vec3f) -> EyeLit {
    let rotation = mat3x3f(eye.to_own[0].xyz, eye.to_own[1].xyz, eye.to_own[2].xyz);
    let d = normalize(rotation * -v);
    let clear = clearness(p);
    let ball = normalize(p - vec3f(0.0, 0.0, eye.middle_mm));
    let cornea = normalize(p - vec3f(0.0, 0.0, CORNEA_AT));
    let on_iris = clamped_to_iris(refracted_to_iris(p, d));
    let film = tears_at(normalize(mix(ball, cornea, clear)), lids);
    let normal = normalize(mix(ball, vec3f(0.0, 0.0, 1.0), clear));
    let iris = clear / (EYE_ETA * EYE_ETA) * iris_colour(eye, on_iris); // light that leaves the medium spreads
    let mixed = (1.0 - clear) * white_colour(eye, p) + iris;
    //#if BANDS
    let colour = in_channels(mixed);
    //#else
    let colour = mixed;
    //#end
    //#if BANDS
    let open = in_channels(lid_transmittance(lids));
    //#else
    let open = lid_transmittance(lids);
    //#end
    let back = transpose(rotation); // rotation and uniform scale, so that it transforms normals
    let below = BelowCornea(length(on_iris) / IRIS_MM * normalize(back * vec3f(on_iris + vec2f(1e-6, 0.0), 0.0)), normalize(back[2]), iris.g / max(mixed.g, 1e-6));
    let film_roughness = mix(TEARS, MENISCUS_ROUGHNESS, meniscus_weight(lids));
    return EyeLit(Surface(normalize(back * normal), colour, film_roughness, 1.0), Film(normalize(back * film), LIT_LIDS * (1.0 - open) * lid_albedo, sky_below_cornea(below) * open, 1.0 - meniscus_weight(lids), below));
}
