// The part of each light's shadow map that hairs lie in, and what they hold back there.
//#include "lights.wgsl"

//#fill const WINDOW: vec2u = vec2u({strand_window}, {strand_window} / 2); // texels across and down
//#fill const WINDOW_HEAD: u32 = {strand_window_words}; // words of a light before its texels: a Window, as bits
const DENSE: f32 = 4096.0; // a texel's first word for hairs that cover it once; its second has their depths
const DEEP: f32 = 4.0; // steps of depth in a millimetre

// Where hairs are on a light's map.
struct Window {
    low: vec2f, // in its clip space
    size: vec2f, // 0 for none
    depth: f32, // of the nearest [mm]
}

// Words before those of a light.
fn window_begin(layer: i32) -> u32 {
    return u32(layer) * (WINDOW_HEAD + 2u * WINDOW.x * WINDOW.y);
}

fn window_word(layer: i32, texel: vec2u) -> u32 {
    return window_begin(layer) + WINDOW_HEAD + 2u * (texel.y * WINDOW.x + texel.x);
}

// Place on a light's map, in its clip space, and depth [mm].
fn on_map(light: Light, p: vec3f) -> vec3f {
    let clip = light.to_map * vec4f(p, 1.0);
    return vec3f(clip.xy / clip.w, depth_of(light, clip.z / clip.w));
}

// Place in a window [texel], and depth beyond its nearest [mm].
fn in_window(window: Window, at: vec3f) -> vec3f {
    return vec3f((at.xy - window.low) / window.size * vec2f(WINDOW), at.z - window.depth);
}
