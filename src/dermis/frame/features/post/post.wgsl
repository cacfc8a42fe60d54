// Exposure, tone curve and sRGB encoding, from radiance to the bytes of a display.
//#include "encoding.wgsl"
//#include "exposure.wgsl"

struct Post {
    exposure: f32, // 0 for the metered one
    tone: u32,
    encoded: u32, // 0 omits the sRGB encoding, an intentional error for comparisons
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
    // Integers, because stores to normalised formats may round up or down.
    let colour_bytes = display_bytes(linear, settings.tone, settings.encoded);
    textureStore(bytes, id.xy, vec4u(colour_bytes, u32(round(255.0 * texel.a))));
}
