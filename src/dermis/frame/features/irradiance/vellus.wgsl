// Vellus hair of the face, as a layer of sparse pale fibres over the skin that scatters light once [KoenderinkPont2003]. The layer
// follows the curvature of the face, so that the path of a grazing ray through it is limited. Steeper views are those without the
// layer, because measured colours of skin include it.

const VELLUS_HEIGHT_MM: f32 = 1.0; // thickness of the layer
const VELLUS_CURVATURE_RADIUS_MM: f32 = 50.0; // of a face
const VELLUS_STEEP_MM: f32 = 1.93; // length of a ray through the layer at 60 degrees from the normal, up to which it has no effect
const VELLUS_ALBEDO: vec3f = vec3f(0.85, 0.79, 0.7); // of pale fibres
const VELLUS_FORWARD: f32 = 0.6; // asymmetry of scattering: fibres transmit more light than they reflect

fn vellus_albedo() -> vec3f {
    //#if BANDS
    return in_channels(VELLUS_ALBEDO);
    //#else
    return VELLUS_ALBEDO;
    //#end
}

// Length of a ray through the layer beyond that of a ray at 60 degrees from the normal [mm].
// cosine : of the ray with the normal
fn vellus_path_mm(cosine: f32) -> f32 {
    let depth = VELLUS_CURVATURE_RADIUS_MM * clamp(cosine, 0.0, 1.0);
    return max(sqrt(depth * depth + 2.0 * VELLUS_CURVATURE_RADIUS_MM * VELLUS_HEIGHT_MM) - depth - VELLUS_STEEP_MM, 0.0);
}

// Fraction of light from below that passes the layer towards the eye; half of the scattered light goes on.
fn through_vellus(n: vec3f, v: vec3f) -> f32 {
    return exp(-0.5 * skin.vellus_per_mm * vellus_path_mm(dot(n, v)));
}

// Radiance towards v per irradiance on a plane across the light.
fn vellus_lobe(n: vec3f, l: vec3f, v: vec3f) -> vec3f {
    let seen = 1.0 - exp(-skin.vellus_per_mm * vellus_path_mm(dot(n, v)));
    let lit = exp(-skin.vellus_per_mm * vellus_path_mm(dot(n, l)));
    return vellus_albedo() * (seen * lit * (1.0 - VELLUS_FORWARD * dot(l, v)) / (4.0 * PI));
}

// Radiance towards v per uniform irradiance, of which the layer sees the half above it.
fn vellus_of_uniform(n: vec3f, v: vec3f) -> vec3f {
    return vellus_albedo() * (0.5 * (1.0 - exp(-skin.vellus_per_mm * vellus_path_mm(dot(n, v)))) / PI);
}
