// Reads an image between its texels, and encodes it for a display.
//#include "bilinear.wgsl"
//#include "srgb.wgsl"

@group(0) @binding(0) var image: texture_2d<f32>;
@group(0) @binding(1) var places: texture_2d<f32>; // uv to read the image at
@group(0) @binding(2) var read: texture_storage_2d<rgba32float, write>;
@group(0) @binding(3) var encoded: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(places))) {
        return;
    }
    let texel = load_bilinear(image, textureLoad(places, id.xy, 0).xy);
    textureStore(read, id.xy, texel);
    textureStore(encoded, id.xy, vec4f(encode_srgb(texel.rgb), 1.0));
}
