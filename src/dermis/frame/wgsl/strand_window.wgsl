// The part of each light's shadow map that hairs may lie in, and what they hold back there.
//#include "lights.wgsl"

//#fill const WINDOW: u32 = {strand_window}; // texels a side
//#fill const WINDOW_HEAD: u32 = {strand_window_words}; // words before the texels: middle of all hairs and their radius [mm], as bits of floats
const DENSE: f32 = 4096.0; // a texel's word for hairs that cover it once
const DEEP: f32 = 4.0; // steps of depth in a millimetre

// Where hairs may be on a light's map.
struct Window {
    middle: vec2f, // in its clip space
    half: vec2f,
    depth: f32, // of its near end [mm]
}

fn window_of(light: Light, ball: vec4f) -> Window {
    let middle = light.to_map * vec4f(ball.xyz, 1.0);
    let right = light.to_map * vec4f(ball.xyz + ball.w * light.map_right, 1.0);
    let up = light.to_map * vec4f(ball.xyz + ball.w * light.map_up, 1.0);
    let place = middle.xy / middle.w;
    let half = max(abs(right.xy / right.w - place), abs(up.xy / up.w - place));
    return Window(place, 1.1 * half, depth_of(light, middle.z / middle.w) - ball.w);
}

// Place in a window [texel], and depth beyond its near end [mm].
fn in_window(light: Light, window: Window, p: vec3f) -> vec3f {
    let clip = light.to_map * vec4f(p, 1.0);
    let place = 0.5 + 0.5 * (clip.xy / clip.w - window.middle) / window.half;
    return vec3f(place * f32(WINDOW), depth_of(light, clip.z / clip.w) - window.depth);
}

fn window_word(layer: i32, texel: vec2u) -> u32 {
    return WINDOW_HEAD + 2u * ((u32(layer) * WINDOW + texel.y) * WINDOW + texel.x);
}
