// Share of a light that hairs let through to a point.
//#include "strand_window.wgsl"

override STRANDS: bool = false; // whether there are hairs

const CLEAR_MM: f32 = 0.2; // a point less far behind hairs than this lies among them
const BEHIND_MM: f32 = 1.5; // and one farther than this behind them

@group(0) @binding(26) var<storage, read> strand_shadows: array<u32>; // see strand_window.wgsl

// Cover and cover times depth of a texel.
fn strands_in(layer: i32, texel: vec2i) -> vec2f {
    if (any(texel < vec2i(0)) || any(texel >= vec2i(i32(WINDOW)))) {
        return vec2f(0.0);
    }
    let word = window_word(layer, vec2u(texel));
    return vec2f(f32(strand_shadows[word]), f32(strand_shadows[word + 1u]) / DEEP) / DENSE;
}

fn past_strands(light: Light, p: vec3f) -> f32 {
    if (!STRANDS || light.layer < 0) {
        return 1.0;
    }
    let ball = vec4f(
        bitcast<f32>(strand_shadows[0]),
        bitcast<f32>(strand_shadows[1]),
        bitcast<f32>(strand_shadows[2]),
        bitcast<f32>(strand_shadows[3]),
    );
    if (ball.w <= 0.0) {
        return 1.0;
    }
    let at = in_window(light, window_of(light, ball), p);
    let place = at.xy - 0.5;
    let corner = vec2i(floor(place));
    let f = place - floor(place);
    if (any(corner < vec2i(-1)) || any(corner >= vec2i(i32(WINDOW))) || at.z < 0.0) {
        return 1.0;
    }
    let low = mix(strands_in(light.layer, corner), strands_in(light.layer, corner + vec2i(1, 0)), f.x);
    let high = mix(strands_in(light.layer, corner + vec2i(0, 1)), strands_in(light.layer, corner + vec2i(1, 1)), f.x);
    let cover = mix(low, high, f.y);
    if (cover.x <= 0.0) {
        return 1.0;
    }
    return exp(-cover.x * smoothstep(CLEAR_MM, BEHIND_MM, at.z - cover.y / cover.x));
}
