// Entering light for one of the profiles after the first: all light that enters, times the blend weight of that profile.
//#include "source.wgsl"
//#include "store.wgsl"

override OTHER: u32; // index of the profile among the others

@group(0) @binding(1) var blend_weights: texture_2d<f32>; // see profile_blend_weights.wgsl

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let light = textureLoad(source, id.xy, 0);
    store(id.xy, vec4f(textureLoad(blend_weights, id.xy, 0)[OTHER] * light.rgb, light.a));
}
