// The rough white surface over the skin: the lobe in use, and how light divides between the surface and the skin.
//#include "surface.wgsl"
//#include <lobes>

// A pipeline is made for one model, so that the others cost nothing.
override MODEL: u32 = 0u;

// Roots of cosine and roughness are evenly spaced in the table of albedos.
//#fill const MIN_ROUGHNESS_ROOT: f32 = {root_of_first_row};

// BRDF for rho_s = 1, without the cosine [1/sr], for light above the surface.
fn lobe(n: vec3f, l: vec3f, v: vec3f, m: f32) -> f32 {
    let a = angles_between(n, l, v);
    if (a.n_h <= 0.0) {
        return 0.0;
    }
    //#each lobes: if (MODEL == {number}) { return {name}(a, m); }
    return 0.0;
}

// Share of light from (or to) a direction that the surface reflects, for rho_s = 1, and its mean over directions.
fn surface_albedo(cos_theta: f32, m: f32) -> vec2f {
    let size = vec2f(textureDimensions(albedo_table));
    let row = (sqrt(m) - MIN_ROUGHNESS_ROOT) / (1.0 - MIN_ROUGHNESS_ROOT);
    let place = vec2f(sqrt(max(cos_theta, 0.0)), row) * (size - 1.0);
    let corner = (floor(place) + 1.0) / size;
    let share = textureGather(0, albedo_table, nearest_sampler, corner);
    let mean = textureGather(1, albedo_table, nearest_sampler, corner);
    return gather_weights(place) * mat2x4f(share, mean);
}

// Share of light from a direction that enters the skin.
fn enters(cos_theta: f32, m: f32, rho_s: f32) -> f32 {
    return max(0.0, 1.0 - rho_s * skin.loss * surface_albedo(cos_theta, m).x);
}

// Share of uniform light from all directions that enters the skin.
fn enters_from_everywhere(m: f32, rho_s: f32) -> f32 {
    return max(0.0, 1.0 - rho_s * skin.loss * surface_albedo(1.0, m).y);
}

// Mean over directions of the share of light that leaves, as of uniform light.
fn leaves_everywhere(m: f32, rho_s: f32) -> f32 {
    let rho = rho_s * skin.loss * surface_albedo(1.0, m).y;
    return max(0.0, 1.0 - rho) / max(1.0 - skin.returned * rho, 0.5);
}

// Share of light that leaves in a direction, over the mean of all directions unless light reflected inside is lost [Kelemen2001].
fn leaves(cos_theta: f32, m: f32, rho_s: f32) -> f32 {
    let rho = rho_s * skin.loss * surface_albedo(cos_theta, m);
    return max(0.0, 1.0 - rho.x) / max(1.0 - skin.returned * rho.y, 0.5);
}
