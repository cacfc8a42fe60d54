// Uniform record of the environment.

struct Environment {
    turn: vec2f, // cosine and sine of the rotation about +Y
    exposure: f32,
    albedo: vec3f, // of skin whose colour map is white
    occluded: u32, // whether there is an occlusion map
    sky: array<vec4f, 32>, // directions all around, and the relative luminance of the sky in each
    sky_moments: array<vec4f, 3>, // of this light, see `SkyMoments`
    mirrors: array<vec4f, 960>, // by roughness, cosine and lobe: direction, roughness and weight
}

@group(0) @binding(20) var<uniform> environment: Environment;
