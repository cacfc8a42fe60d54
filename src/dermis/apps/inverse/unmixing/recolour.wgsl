// Colours of skins with changed pigments, times the residual of the original colours.
//#include "skin_model.wgsl"

struct Change {
    factors: vec3f, // of melanin, blood and the extra unknown
    added: vec3f,
}

@group(0) @binding(2) var<uniform> change: Change;
@group(0) @binding(3) var estimate: texture_2d<f32>; // melanin, blood, extra unknown
@group(0) @binding(4) var residual: texture_2d<f32>;
@group(0) @binding(5) var recoloured: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(estimate))) {
        return;
    }
    let pigments = textureLoad(estimate, id.xy, 0).xyz * change.factors + change.added;
    let x = vec3f(sqrt(clamp(pigments.xy, vec2f(0.0), vec2f(1.0))), pigments.z);
    textureStore(recoloured, id.xy, vec4f(exp(evaluate(x).logs) * textureLoad(residual, id.xy, 0).rgb, 1.0));
}
