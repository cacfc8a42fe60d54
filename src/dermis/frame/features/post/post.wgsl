// From radiance to the display's bytes: exposure, tone curve and sRGB encoding.
//#include "encoding.wgsl"
//#include "exposure.wgsl"

struct Post {
    exposure: f32, // 0 for the meter's
    tone: u32,
    encoded: u32, // 0 leaves the encoding out, which is wrong
}

@group(0) @binding(0) var<uniform> settings: Post;
@group(0) @binding(1) var image: texture_2d<f32>;
@group(0) @binding(2) var exposed: texture_storage_2d<rgba32float, write>;
@group(0) @binding(3) var bytes: texture_storage_2d<rgba8uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(image))) {
        return;
    }
    let texel = textureLoad(image, id.xy, 0);
    let linear = texel.rgb * exposure_of(settings.exposure);
    textureStore(exposed, id.xy, vec4f(linear, texel.a));
    // Integers, because a store to a normalised format may round either way.
    let levels = levels_of(linear, settings.tone, settings.encoded);
    textureStore(bytes, id.xy, vec4u(levels, u32(round(255.0 * texel.a))));
}
