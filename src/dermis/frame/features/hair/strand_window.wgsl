// The part of each light's shadow map that hairs lie in, and what they hold back there, by depth: a deep opacity map.
// Source: [YukselKeyser2008].
//#include "lights.wgsl"

//#fill const STRAND_WINDOW: u32 = {strand_window}; // texels across, half as many down
//#fill const WINDOW_HEAD: u32 = {strand_window_words}; // words of a light before its texels: low and high ends of hairs
//#fill const HAIR_LAYERS: u32 = {strand_layers}; // of depth behind the nearest hair of a texel
const TEXEL_WORDS: u32 = 1u + HAIR_LAYERS; // depth of the nearest, then what hairs of each layer cover
const FIRST_LAYER_MM: f32 = 1.0; // thickness; each further one is twice as thick
const DENSE: f32 = 4096.0; // a word for hairs that cover a texel once
const DEEP: f32 = 256.0; // steps of depth in a millimetre
const NO_HAIR: u32 = 0xffffffffu; // depth of the nearest where there are none

const NARROWEST: f32 = 0.2; // width of a window over its length, at least
const BORDER: f32 = 3.0; // texels around all hairs that stay empty
const SIGN: u32 = 0x80000000u;

// Whole numbers in the order of the numbers that they stand for, and back: of these atomics find the least.
fn ordered(numbers: vec3f) -> vec3u {
    let bits = bitcast<vec3u>(numbers);
    return select(bits | vec3u(SIGN), ~bits, bits >= vec3u(SIGN));
}

fn number_in_order(places: vec3u) -> vec3f {
    return bitcast<vec3f>(select(~places, places ^ vec3u(SIGN), places >= vec3u(SIGN)));
}

// Where hairs are on a light's map.
struct Window {
    low: vec2f, // in its clip space
    size: vec2f, // 0 for none
    depth: f32, // of the nearest [mm]
}

fn window_size() -> vec2u {
    return vec2u(STRAND_WINDOW, STRAND_WINDOW / 2u);
}

// The window of hairs from one end to the other, as they are `ordered`.
fn window_around(low: vec3u, high: vec3u) -> Window {
    let nearest = number_in_order(low);
    let farthest = number_in_order(high);
    let span = farthest.xy - nearest.xy;
    let texels = vec2f(window_size());
    let wide = max(span, vec2f(NARROWEST * max(span.x, span.y) + 1e-6)) * texels / (texels - 2.0 * BORDER);
    return Window(0.5 * (farthest.xy + nearest.xy - wide), wide, nearest.z);
}

// Words before those of a light.
fn window_begin(layer: i32) -> u32 {
    return u32(layer) * (WINDOW_HEAD + TEXEL_WORDS * STRAND_WINDOW * STRAND_WINDOW / 2u);
}

fn window_word(layer: i32, texel: vec2u) -> u32 {
    return window_begin(layer) + WINDOW_HEAD + TEXEL_WORDS * (texel.y * STRAND_WINDOW + texel.x);
}

// How many layers lie before a depth behind a texel's nearest hair.
fn layers_before(behind_mm: f32) -> f32 {
    return log2(1.0 + max(behind_mm, 0.0) / FIRST_LAYER_MM);
}

// Place on a light's map, in its clip space, and depth [mm].
fn on_map(light: Light, p: vec3f) -> vec3f {
    let clip = light.to_map * vec4f(p, 1.0);
    return vec3f(clip.xy / clip.w, depth_of(light, clip.z / clip.w));
}

// Place in a window [texel], and depth beyond its nearest [mm].
fn in_window(window: Window, at: vec3f) -> vec3f {
    return vec3f((at.xy - window.low) / window.size * vec2f(window_size()), at.z - window.depth);
}
