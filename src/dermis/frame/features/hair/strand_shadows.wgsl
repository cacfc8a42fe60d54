// Shadows of strands: the amount of hair between a light and a point.
//#include "strand_window.wgsl"

override STRANDS: bool = false; // whether there are strands

const FADING_MM: f32 = 100.0; // distance from the grid of the sky beyond which hair hides no sky
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

// Transmittances of hair as linear functions of direction, see sky_transmittance.wgsl.
struct SkyTransmittance {
    hair: vec4f, // past hair alone
    all: vec4f, // past hair and head
}

fn sky_transmittance_of(cell: vec3u) -> SkyTransmittance {
    let word = transmittance_word(sky_cell_index(cell));
    let hair = vec4f(unpack2x16float(strand_shadows[word]), unpack2x16float(strand_shadows[word + 1u]));
    let all = vec4f(unpack2x16float(strand_shadows[word + 2u]), unpack2x16float(strand_shadows[word + 3u]));
    return SkyTransmittance(hair, all);
}

fn sky_grid() -> SkyGrid {
    let low = vec3u(strand_shadows[0], strand_shadows[1], strand_shadows[2]);
    let high = vec3u(strand_shadows[3], strand_shadows[4], strand_shadows[5]);
    return make_sky_grid(low, high);
}

// Transmittances at a point; outside the grid, those of its border, which increase to 1 with the distance.
fn sky_transmittance_at(grid: SkyGrid, p: vec3f) -> SkyTransmittance {
    let clear = vec4f(vec3f(0.0), 1.0);
    if (any(grid.cell <= vec3f(0.0))) {
        return SkyTransmittance(clear, clear);
    }
    let last = vec3f(SKY_CELLS) - 1.0;
    let unclamped = (p - grid.low) / grid.cell - 0.5;
    let at = clamp(unclamped, vec3f(0.0), last);
    let outside = saturate(length((unclamped - at) * grid.cell) / FADING_MM);
    let low = min(vec3u(at), SKY_CELLS - 2u);
    let f = at - vec3f(low);
    var sum = SkyTransmittance(vec4f(0.0), vec4f(0.0));
    for (var k = 0u; k < 8u; k += 1u) {
        let corner = vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u);
        let w = mix(1.0 - f, f, vec3f(corner));
        let one = sky_transmittance_of(low + corner);
        sum.hair += w.x * w.y * w.z * one.hair;
        sum.all += w.x * w.y * w.z * one.all;
    }
    return SkyTransmittance(mix(sum.hair, clear, outside), mix(sum.all, clear, outside));
}

// Fraction of the light of the sky that hair transmits to a surface. The transmittance is read below the surface, so that
// directions from there pass through the whole layer of hair on it.
// mean_direction: mean of the unit vectors of the directions from which light is collected
fn sky_past_hair(p: vec3f, normal: vec3f, mean_direction: vec3f) -> f32 {
    if (!STRANDS) {
        return 1.0;
    }
    let grid = sky_grid();
    let hair = sky_transmittance_at(grid, p - grid.cell * normal).hair;
    return clamp(hair.w + dot(hair.xyz, mean_direction), 0.0, 1.0);
}

// Fraction of a light that strands transmit to a point.
fn strand_transmittance(light: Light, p: vec3f) -> f32 {
    return exp(-strand_cover(light, p));
}
