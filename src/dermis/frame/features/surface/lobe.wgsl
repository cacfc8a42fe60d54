// Rough dielectric surface of the skin: the specular lobe in use, and the transmission of light.
//#include "surface.wgsl"
//#include <lobes>

// Each pipeline is compiled for one model.
override MODEL: u32 = 0u;

// Square roots of cosine and roughness are evenly spaced in the albedo table.
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

// Directional albedo of the surface for rho_s = 1, and its mean over directions.
fn surface_albedo(cos_theta: f32, m: f32) -> vec2f {
    let size = vec2f(textureDimensions(albedo_table));
    let row = (sqrt(m) - MIN_ROUGHNESS_ROOT) / (1.0 - MIN_ROUGHNESS_ROOT);
    let position = vec2f(sqrt(max(cos_theta, 0.0)), row) * (size - 1.0);
    let corner = (floor(position) + 1.0) / size;
    let directional = textureGather(0, albedo_table, nearest_sampler, corner);
    let mean = textureGather(1, albedo_table, nearest_sampler, corner);
    return gather_weights(position) * mat2x4f(directional, mean);
}

// Fraction of light from a direction that enters the skin.
fn enters(cos_theta: f32, m: f32, rho_s: f32) -> f32 {
    return max(0.0, 1.0 - rho_s * skin.loss * surface_albedo(cos_theta, m).x);
}

// Fraction of uniform light that enters the skin.
fn enters_uniform(m: f32, rho_s: f32) -> f32 {
    return max(0.0, 1.0 - rho_s * skin.loss * surface_albedo(1.0, m).y);
}

// Fraction of uniform light that leaves the skin.
fn leaves_uniform(m: f32, rho_s: f32) -> f32 {
    let rho = rho_s * skin.loss * surface_albedo(1.0, m).y;
    return max(0.0, 1.0 - rho) / max(1.0 - skin.returned * rho, 0.5);
}

// Fraction of light that leaves in a direction, relative to the mean over directions unless light reflected inside is lost [Kelemen2001].
fn leaves(cos_theta: f32, m: f32, rho_s: f32) -> f32 {
    let rho = rho_s * skin.loss * surface_albedo(cos_theta, m);
    return max(0.0, 1.0 - rho.x) / max(1.0 - skin.returned * rho.y, 0.5);
}
