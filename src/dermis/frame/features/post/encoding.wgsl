// From exposed light to the display's levels: tone curve and sRGB encoding.
//#include "srgb.wgsl"
//#include "tone.wgsl"

// right: 0 leaves the encoding out, which is wrong
fn levels_of(linear: vec3f, tone: u32, right: u32) -> vec3u {
    let shown = toned(linear, tone);
    let levels = select(clamp(shown, vec3f(0.0), vec3f(1.0)), encode_srgb(shown), right != 0u);
    return vec3u(round(255.0 * levels));
}
