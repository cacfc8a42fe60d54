// Half of the light of a texel, in its place.
//#include "store.wgsl"

@group(0) @binding(0) var light: texture_2d<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(light))) {
        let entered = textureLoad(light, id.xy, 0);
        store(id.xy, vec4f(0.5 * entered.rgb, entered.a));
    }
}
