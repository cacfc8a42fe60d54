// Share of a light that hairs let through to a point.
//#include "strand_window.wgsl"

override STRANDS: bool = false; // whether there are hairs

const AMONG_MM: f32 = 0.2; // a point less far behind hairs than this lies among them
const BEHIND_MM: f32 = 1.5; // and one farther than this behind them

@group(0) @binding(26) var<storage, read> strand_shadows: array<u32>; // see strand_window.wgsl

fn window_of(layer: i32) -> Window {
    let word = window_begin(layer);
    let low = vec2u(strand_shadows[word], strand_shadows[word + 1u]);
    let size = vec2u(strand_shadows[word + 2u], strand_shadows[word + 3u]);
    return Window(bitcast<vec2f>(low), bitcast<vec2f>(size), bitcast<f32>(strand_shadows[word + 4u]));
}

// Cover and cover times depth of a texel.
fn strands_in(layer: i32, texel: vec2i) -> vec2f {
    let inside = clamp(texel, vec2i(0), vec2i(WINDOW) - 1); // its border is empty
    let word = window_word(layer, vec2u(inside));
    return vec2f(f32(strand_shadows[word]), f32(strand_shadows[word + 1u]) / DEEP) / DENSE;
}

fn past_strands(light: Light, p: vec3f) -> f32 {
    if (!STRANDS || light.layer < 0) {
        return 1.0;
    }
    let window = window_of(light.layer);
    let at = on_map(light, p);
    if (any(at.xy <= window.low) || any(at.xy >= window.low + window.size) || at.z < window.depth) {
        return 1.0;
    }
    let place = in_window(window, at) - vec3f(0.5, 0.5, 0.0);
    let corner = vec2i(floor(place.xy));
    let f = place.xy - floor(place.xy);
    let low = mix(strands_in(light.layer, corner), strands_in(light.layer, corner + vec2i(1, 0)), f.x);
    let high = mix(strands_in(light.layer, corner + vec2i(0, 1)), strands_in(light.layer, corner + vec2i(1, 1)), f.x);
    let cover = mix(low, high, f.y);
    if (cover.x <= 0.0) {
        return 1.0;
    }
    return exp(-cover.x * smoothstep(AMONG_MM, BEHIND_MM, place.z - cover.y / cover.x));
}
