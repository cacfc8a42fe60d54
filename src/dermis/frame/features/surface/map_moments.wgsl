// Slopes and their squares; the means of both over a footprint give the normal and the roughness there [OlanoBaker2010].
//#include "store.wgsl"

@group(0) @binding(0) var slopes: texture_2d<f32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(slopes))) {
        let slope = textureLoad(slopes, id.xy, 0).xy;
        store(id.xy, vec4f(slope, slope * slope));
    }
}
