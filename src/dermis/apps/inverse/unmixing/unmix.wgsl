// Melanin and blood of each texel's colour, how well they can be known, and what no skin of the model accounts for.
//#include "skin_model.wgsl"
//#include "first_guess.wgsl"

@group(0) @binding(2) var<storage, read> starts: array<vec2f>;
@group(0) @binding(3) var colours: texture_2d<f32>; // diffuse reflectance, linear
@group(0) @binding(4) var shares: texture_storage_2d<rgba32float, write>; // melanin, blood, and their standard deviations
@group(0) @binding(5) var residual: texture_storage_2d<rgba32float, write>; // the colour over the model's; the third number

fn guess_for(logs: vec3f) -> vec2f {
    let place = place_among_guesses(logs);
    let node = min(vec2u(place), vec2u(SIDE - 2u));
    let part = place - vec2f(node);
    let first = node.y * SIDE + node.x;
    let near = mix(starts[first], starts[first + 1u], part.x);
    return mix(near, mix(starts[first + SIDE], starts[first + SIDE + 1u], part.x), part.y);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(colours))) {
        return;
    }
    let colour = max(textureLoad(colours, id.xy, 0).rgb, vec3f(model.darkest));
    let logs = log(colour);
    let weights = weights_of(colour);
    let found = solved(vec3f(guess_for(logs), model.usual), logs, weights);
    let r = reduced(found.system);
    let sd = sqrt(vec2f(r[2], r[0]) / max(r[0] * r[2] - r[1] * r[1], 1e-9 * r[0] * r[2]));
    let x = found.x;
    // A share is the square of its root: its deviation is twice the root times the root's, and that squared.
    textureStore(shares, id.xy, vec4f(x.xy * x.xy, 2.0 * x.xy * sd + sd * sd));
    textureStore(residual, id.xy, vec4f(exp(found.system.off), x.z));
}
