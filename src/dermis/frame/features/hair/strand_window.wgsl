// Deep opacity map of each light: the cover by strands in several layers of depth, within the window of the light's shadow map
// that contains all strands.
//#include "lights.wgsl"
//#include "strand_sky.wgsl"
//#include "opacity_layers.wgsl"

//#fill const STRAND_WINDOW: u32 = {strand_window}; // texels across, half as many down
//#fill const WINDOW_HEAD: u32 = {strand_window_words}; // words of a light before its texels: bounds of the strands
const NARROWEST: f32 = 0.2; // least ratio of the width of a window to its length
const BORDER: f32 = 3.0; // empty texels around all strands
const SIGN: u32 = 0x80000000u;

// Integers that are ordered like the floats that they encode, for atomic minima, and their decoding.
fn sortable(numbers: vec3f) -> vec3u {
    let bits = bitcast<vec3u>(numbers);
    return select(bits | vec3u(SIGN), ~bits, bits >= vec3u(SIGN));
}

fn from_sortable(integers: vec3u) -> vec3f {
    return bitcast<vec3f>(select(~integers, integers ^ vec3u(SIGN), integers >= vec3u(SIGN)));
}

// Bounds of the strands on the map of a light.
struct Window {
    low: vec2f, // in clip space
    size: vec2f, // 0 without strands
    depth: f32, // of the nearest strand [mm]
}

fn window_size() -> vec2u {
    return vec2u(STRAND_WINDOW, STRAND_WINDOW / 2u);
}

// Window around bounds, given as `sortable` integers.
fn make_window(low: vec3u, high: vec3u) -> Window {
    let nearest = from_sortable(low);
    let farthest = from_sortable(high);
    let span = farthest.xy - nearest.xy;
    let texels = vec2f(window_size());
    let wide = max(span, vec2f(NARROWEST * max(span.x, span.y) + 1e-6)) * texels / (texels - 2.0 * BORDER);
    return Window(0.5 * (farthest.xy + nearest.xy - wide), wide, nearest.z);
}

// Index of the first word of a light's map.
fn first_word(layer: i32) -> u32 {
    return sky_words() + u32(layer) * (WINDOW_HEAD + TEXEL_WORDS * STRAND_WINDOW * STRAND_WINDOW / 2u);
}

fn texel_word(layer: i32, texel: vec2u) -> u32 {
    return first_word(layer) + WINDOW_HEAD + TEXEL_WORDS * (texel.y * STRAND_WINDOW + texel.x);
}

// Position on the map of a light in clip space, and depth [mm].
fn project_to_map(light: Light, p: vec3f) -> vec3f {
    let clip = light.to_map * vec4f(p, 1.0);
    return vec3f(clip.xy / clip.w, depth_of(light, clip.z / clip.w));
}

// Position in a window [texel], and depth behind its nearest strand [mm].
fn to_window(window: Window, at: vec3f) -> vec3f {
    return vec3f((at.xy - window.low) / window.size * vec2f(window_size()), at.z - window.depth);
}
