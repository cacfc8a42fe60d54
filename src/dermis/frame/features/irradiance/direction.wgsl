// Directional response of a half-space: reflectance increases towards grazing incidence, and single scattering leaves mostly
// at grazing angles.
//#include "surface/surface.wgsl"

override HALF_SPACE: bool = false; // whether skin has a directional response; else it is Lambertian

const DIRECTIONS: u32 = 32u; // rows of the tables, as in optics/angular_response.py

// Reflectance of light from a direction, relative to normal incidence.
fn relative_reflectance(cosine: f32) -> vec3f {
    let row = sqrt(clamp(cosine, 0.0, 1.0)) * f32(DIRECTIONS - 1u);
    let low = min(u32(row), DIRECTIONS - 2u);
    return mix(skin.reflectance[low].rgb, skin.reflectance[low + 1u].rgb, row - f32(low));
}

// Transmittance of deep slabs for light from a direction, relative to uniform light with equal reflectance.
fn relative_transmittance(cosine: f32) -> vec3f {
    let row = sqrt(clamp(cosine, 0.0, 1.0)) * f32(DIRECTIONS - 1u);
    let low = min(u32(row), DIRECTIONS - 2u);
    return mix(skin.transmittance[low].rgb, skin.transmittance[low + 1u].rgb, row - f32(low));
}

// Cosine of the refracted direction; never 0, so that sums of two are positive.
fn refracted(cosine: f32) -> f32 {
    return sqrt(max(1.0 - (1.0 - cosine * cosine) / (skin.eta_below * skin.eta_below), 1e-8));
}

// Mean of 1/(a + b) over exit directions; a and b are the refracted cosines of entry and exit.
fn mean_single_scattering_at(a: f32) -> f32 {
    let square = skin.eta_below * skin.eta_below;
    let critical = sqrt(max(1.0 - 1.0 / square, 0.0)); // rounding can give negative values
    return 2.0 * square * (1.0 - critical - a * log((a + 1.0) / (a + critical)));
}

// Single scattering from one direction to another minus its mean over exit directions, relative to normal incidence.
fn directional_excess(cosine_in: f32, cosine_out: f32) -> vec3f {
    let a = refracted(cosine_in);
    return skin.single_scattering * (1.0 / (a + refracted(cosine_out)) - mean_single_scattering_at(a));
}

// Single scattering of uniform light in an exit direction minus its mean, relative to normal incidence.
fn uniform_directional_excess(cosine_out: f32) -> vec3f {
    return skin.single_scattering * (mean_single_scattering_at(refracted(cosine_out)) - skin.mean_single_scattering);
}
