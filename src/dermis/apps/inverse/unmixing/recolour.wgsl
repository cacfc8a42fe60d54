// The colours of other skins with what the model did not account for of the first ones.
//#include "skin_model.wgsl"

struct Change {
    factors: vec3f, // of melanin, blood and what is left of the third number
    added: vec3f,
}

@group(0) @binding(2) var<uniform> change: Change;
@group(0) @binding(3) var made: texture_2d<f32>; // melanin, blood, the third number
@group(0) @binding(4) var residual: texture_2d<f32>;
@group(0) @binding(5) var recoloured: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(made))) {
        return;
    }
    let shares = textureLoad(made, id.xy, 0).xyz * change.factors + change.added;
    let x = vec3f(sqrt(clamp(shares.xy, vec2f(0.0), vec2f(1.0))), shares.z);
    textureStore(recoloured, id.xy, vec4f(exp(slopes_at(x).logs) * textureLoad(residual, id.xy, 0).rgb, 1.0));
}
