// The picture of skin whose light spread in screen space: the part of it that leaves, plus the light that did not spread.

@group(0) @binding(0) var over: texture_2d<f32>; // light that does not spread, and coverage
@group(0) @binding(1) var below: texture_2d<f32>; // light below the skin, spread
@group(0) @binding(2) var leaving: texture_2d<f32>; // share of it that leaves towards the eye
@group(0) @binding(3) var image: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(over))) {
        return;
    }
    let top = textureLoad(over, id.xy, 0);
    let light = textureLoad(below, id.xy, 0).rgb * textureLoad(leaving, id.xy, 0).rgb;
    textureStore(image, id.xy, vec4f(top.rgb + light, top.a));
}
