// What a half-space does with light by its directions: more of what enters aslant comes back, and what scattered only
// once leaves mostly aslant, the more so the more aslant it came.
//#include "surface.wgsl"

override HALF_SPACE: bool = false; // whether skin does so; else it is a diffuse surface

const DIRECTIONS: u32 = 32u; // rows of the table, as in optics/directions.py

// Share of light from a direction that comes back, over that from straight above.
fn coming_back(cosine: f32) -> vec3f {
    let row = sqrt(clamp(cosine, 0.0, 1.0)) * f32(DIRECTIONS - 1u);
    let low = min(u32(row), DIRECTIONS - 2u);
    return mix(skin.back[low].rgb, skin.back[low + 1u].rgb, row - f32(low));
}

// Cosine below the surface; never 0, so that neither is a sum of two.
fn refracted(cosine: f32) -> f32 {
    return sqrt(max(1.0 - (1.0 - cosine * cosine) / (skin.inner_eta * skin.inner_eta), 1e-8));
}

// Mean of 1/(a + b) over where light leaves to, a and b the cosines below the surface.
fn mean_of_once(a: f32) -> f32 {
    let square = skin.inner_eta * skin.inner_eta;
    let critical = sqrt(max(1.0 - 1.0 / square, 0.0)); // a quotient of equals may be more than 1
    return 2.0 * square * (1.0 - critical - a * log((a + 1.0) / (a + critical)));
}

// What leaves in a direction beyond the mean over all, of light from a direction with a share of 1 from straight above.
fn beyond_mean(cosine_in: f32, cosine_out: f32) -> vec3f {
    let a = refracted(cosine_in);
    return skin.once * (1.0 / (a + refracted(cosine_out)) - mean_of_once(a));
}

// The same of light from all directions alike.
fn beyond_mean_from_everywhere(cosine_out: f32) -> vec3f {
    return skin.once * (mean_of_once(refracted(cosine_out)) - skin.mean_once);
}
