// Tone curve and sRGB encoding, from exposed light to the bytes of a display.
//#include "srgb.wgsl"
//#include "tone.wgsl"

// encoded: 0 omits the sRGB encoding, an intentional error for comparisons
fn display_bytes(linear: vec3f, tone: u32, encoded: u32) -> vec3u {
    let shown = toned(linear, tone);
    let levels = select(clamp(shown, vec3f(0.0), vec3f(1.0)), encode_srgb(shown), encoded != 0u);
    return vec3u(round(255.0 * levels));
}
