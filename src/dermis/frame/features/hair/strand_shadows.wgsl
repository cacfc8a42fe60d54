// How much hair light passes on its way to a point.
//#include "strand_window.wgsl"

override STRANDS: bool = false; // whether there are hairs

const AMONG_MM: f32 = 0.25; // hairs less far in front of a point do not shade it: it lies among them

@group(0) @binding(26) var<storage, read> strand_shadows: array<u32>; // see strand_window.wgsl

fn window_of(layer: i32) -> Window {
    let word = window_begin(layer);
    let low = vec3u(strand_shadows[word], strand_shadows[word + 1u], strand_shadows[word + 2u]);
    let high = vec3u(strand_shadows[word + 3u], strand_shadows[word + 4u], strand_shadows[word + 5u]);
    return window_around(low, high);
}

// What hairs of a texel cover in front of a depth.
fn cover_in(layer: i32, texel: vec2i, depth: f32) -> f32 {
    let inside = clamp(texel, vec2i(0), vec2i(window_size()) - 1); // its border is empty
    let word = window_word(layer, vec2u(inside));
    let nearest = strand_shadows[word];
    if (nearest == NO_HAIR) {
        return 0.0;
    }
    let before = layers_before(depth - f32(nearest) / DEEP);
    var sum = 0.0;
    for (var k = 0u; k < HAIR_LAYERS; k += 1u) {
        sum += saturate(before - f32(k)) * f32(strand_shadows[word + 1u + k]);
    }
    return sum / DENSE;
}

// Hairs on the way from a light to a point: what they cover of it, over each other.
fn strands_before(light: Light, p: vec3f) -> f32 {
    if (!STRANDS || light.layer < 0) {
        return 0.0;
    }
    let window = window_of(light.layer);
    let at = on_map(light, p);
    if (any(at.xy <= window.low) || any(at.xy >= window.low + window.size) || at.z < window.depth) {
        return 0.0;
    }
    let place = in_window(window, at) - vec3f(0.5, 0.5, AMONG_MM);
    let corner = vec2i(floor(place.xy));
    let f = place.xy - floor(place.xy);
    let a = cover_in(light.layer, corner, place.z);
    let b = cover_in(light.layer, corner + vec2i(1, 0), place.z);
    let c = cover_in(light.layer, corner + vec2i(0, 1), place.z);
    let d = cover_in(light.layer, corner + vec2i(1, 1), place.z);
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}

// Share of a light that hairs let through to a point.
fn past_strands(light: Light, p: vec3f) -> f32 {
    return exp(-strands_before(light, p));
}
