// The light that enters skin of another profile: all that enters, times that profile's share of the skin.
//#include "source.wgsl"
//#include "store.wgsl"

override OTHER: u32; // which of the other profiles, from 0

@group(0) @binding(1) var shares: texture_2d<f32>; // as profile_blend_weights.wgsl stores them

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let light = textureLoad(source, id.xy, 0);
    store(id.xy, vec4f(textureLoad(shares, id.xy, 0)[OTHER] * light.rgb, light.a));
}
