// How a half-space returns light by direction: more comes back of light that enters at grazing angles, and light that
// scattered only once leaves mostly at grazing angles, the more so the more grazing it came.
//#include "surface/surface.wgsl"

override HALF_SPACE: bool = false; // whether skin does so; else it is a Lambertian surface

const DIRECTIONS: u32 = 32u; // rows of the table, as in optics/angular_response.py

// Share of light from a direction that comes back, over the share from straight above.
fn coming_back(cosine: f32) -> vec3f {
    let row = sqrt(clamp(cosine, 0.0, 1.0)) * f32(DIRECTIONS - 1u);
    let low = min(u32(row), DIRECTIONS - 2u);
    return mix(skin.back[low].rgb, skin.back[low + 1u].rgb, row - f32(low));
}

// Light that passes deep slabs from a direction, over that from everywhere of which as much comes back.
fn going_across(cosine: f32) -> vec3f {
    let row = sqrt(clamp(cosine, 0.0, 1.0)) * f32(DIRECTIONS - 1u);
    let low = min(u32(row), DIRECTIONS - 2u);
    return mix(skin.across[low].rgb, skin.across[low + 1u].rgb, row - f32(low));
}

// Cosine below the surface; never 0, so that the sum of two is not either.
fn refracted(cosine: f32) -> f32 {
    return sqrt(max(1.0 - (1.0 - cosine * cosine) / (skin.inner_eta * skin.inner_eta), 1e-8));
}

// Mean of 1/(a + b) over outgoing directions; a and b are the cosines below the surface on the way in and out.
fn mean_of_once(a: f32) -> f32 {
    let square = skin.inner_eta * skin.inner_eta;
    let critical = sqrt(max(1.0 - 1.0 / square, 0.0)); // 1 / 1 may be rounded to more than 1
    return 2.0 * square * (1.0 - critical - a * log((a + 1.0) / (a + critical)));
}

// Light from one direction that leaves in another, less the mean over all outgoing ones; over light from straight above.
fn beyond_mean(cosine_in: f32, cosine_out: f32) -> vec3f {
    let a = refracted(cosine_in);
    return skin.once * (1.0 / (a + refracted(cosine_out)) - mean_of_once(a));
}

// The same for uniform light from all directions.
fn beyond_mean_from_everywhere(cosine_out: f32) -> vec3f {
    return skin.once * (mean_of_once(refracted(cosine_out)) - skin.mean_once);
}
