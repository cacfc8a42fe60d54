// Melanin and blood of each texel's colour with their standard deviations, and the residual of the model.
//#include "skin_model.wgsl"
//#include "first_guess.wgsl"

@group(0) @binding(2) var<storage, read> guesses: array<vec2f>;
@group(0) @binding(3) var colours: texture_2d<f32>; // diffuse reflectance, linear
@group(0) @binding(4) var fractions: texture_storage_2d<rgba32float, write>; // melanin, blood, and their standard deviations
@group(0) @binding(5) var residual: texture_storage_2d<rgba32float, write>; // ratio of the colour to the model's; extra unknown

fn initial_guess(logs: vec3f) -> vec2f {
    let position = guess_position(logs);
    let node = min(vec2u(position), vec2u(SIDE - 2u));
    let fraction = position - vec2f(node);
    let first = node.y * SIDE + node.x;
    let near = mix(guesses[first], guesses[first + 1u], fraction.x);
    return mix(near, mix(guesses[first + SIDE], guesses[first + SIDE + 1u], fraction.x), fraction.y);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(colours))) {
        return;
    }
    let colour = max(textureLoad(colours, id.xy, 0).rgb, vec3f(model.min_reflectance));
    let logs = log(colour);
    let weights = inverse_variances(colour);
    let result = solve(vec3f(initial_guess(logs), model.prior_mean), logs, weights);
    let r = eliminate_extra(result.system);
    let sd = sqrt(vec2f(r[2], r[0]) / max(r[0] * r[2] - r[1] * r[1], 1e-9 * r[0] * r[2]));
    let x = result.x;
    // A fraction is the square of its root r: its deviation is 2 r sd + sd^2.
    textureStore(fractions, id.xy, vec4f(x.xy * x.xy, 2.0 * x.xy * sd + sd * sd));
    textureStore(residual, id.xy, vec4f(exp(result.system.difference), x.z));
}
