// Shadows of strands: the amount of hair between a light and a point.
//#include "strand_window.wgsl"

override STRANDS: bool = false; // whether there are strands

const AMONG_MM: f32 = 0.25; // strands that are nearer to a point cast no shadow on it: it lies among them

@group(0) @binding(26) var<storage, read> strand_shadows: array<u32>; // see strand_window.wgsl

fn window_of(layer: i32) -> Window {
    let word = first_word(layer);
    let low = vec3u(strand_shadows[word], strand_shadows[word + 1u], strand_shadows[word + 2u]);
    let high = vec3u(strand_shadows[word + 3u], strand_shadows[word + 4u], strand_shadows[word + 5u]);
    return make_window(low, high);
}

// Cover by the strands of a texel in front of a depth.
fn cover_before(layer: i32, texel: vec2i, depth: f32) -> f32 {
    let inside = clamp(texel, vec2i(0), vec2i(window_size()) - 1); // the border is empty
    let word = texel_word(layer, vec2u(inside));
    let nearest = strand_shadows[word];
    if (nearest == NO_HAIR) {
        return 0.0;
    }
    let before = layer_at(depth - f32(nearest) / DEPTH_SCALE);
    var sum = 0.0;
    for (var k = 0u; k < HAIR_LAYERS; k += 1u) {
        sum += saturate(before - f32(k)) * f32(strand_shadows[word + 1u + k]);
    }
    return sum / COVER_SCALE;
}

// Cover by all strands between a light and a point.
fn strand_cover(light: Light, p: vec3f) -> f32 {
    if (!STRANDS || light.layer < 0) {
        return 0.0;
    }
    let window = window_of(light.layer);
    let at = project_to_map(light, p);
    if (any(at.xy <= window.low) || any(at.xy >= window.low + window.size) || at.z < window.depth) {
        return 0.0;
    }
    let position = to_window(window, at) - vec3f(0.5, 0.5, AMONG_MM);
    let corner = vec2i(floor(position.xy));
    let f = position.xy - floor(position.xy);
    let a = cover_before(light.layer, corner, position.z);
    let b = cover_before(light.layer, corner + vec2i(1, 0), position.z);
    let c = cover_before(light.layer, corner + vec2i(0, 1), position.z);
    let d = cover_before(light.layer, corner + vec2i(1, 1), position.z);
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}

// Fraction of a light that strands transmit to a point.
fn strand_transmittance(light: Light, p: vec3f) -> f32 {
    return exp(-strand_cover(light, p));
}
