// Shadows of strands: the amount of hair between a light and a point.
//#include "strand_window.wgsl"

override STRANDS: bool = false; // whether there are strands

const FADING_MM: f32 = 100.0; // distance from the grid of the sky beyond which hair hides no sky
const PENUMBRA_POINTS: u32 = 16u; // points of an area light whose light past hair is averaged
const BLOCKER_POINTS: u32 = 8u; // points of an area light towards which hair is searched
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

fn sky_moments_of(cell: vec3u) -> SkyMoments {
    let word = transmittance_word(sky_cell_index(cell)) + 4u;
    let first = vec4f(unpack2x16float(strand_shadows[word]), unpack2x16float(strand_shadows[word + 1u]));
    let second = vec4f(unpack2x16float(strand_shadows[word + 2u]), unpack2x16float(strand_shadows[word + 3u]));
    return SkyMoments(first, second.xyz, vec3f(second.w, unpack2x16float(strand_shadows[word + 4u])));
}

fn sky_grid() -> SkyGrid {
    let low = vec3u(strand_shadows[0], strand_shadows[1], strand_shadows[2]);
    let high = vec3u(strand_shadows[3], strand_shadows[4], strand_shadows[5]);
    return make_sky_grid(low, high);
}

// Position in the grid: of the eight cells around a point the one with the lowest indices, the weights of the upper cells along each
// axis, and how far the point is outside the grid, where transmittance increases to 1.
struct SkyPosition {
    low: vec3u,
    upper: vec3f,
    outside: f32,
}

fn sky_position(grid: SkyGrid, p: vec3f) -> SkyPosition {
    let last = vec3f(SKY_CELLS) - 1.0;
    let unclamped = (p - grid.low) / grid.cell - 0.5;
    let at = clamp(unclamped, vec3f(0.0), last);
    let low = min(vec3u(at), SKY_CELLS - 2u);
    return SkyPosition(low, at - vec3f(low), saturate(length((unclamped - at) * grid.cell) / FADING_MM));
}

fn cell_corner(k: u32) -> vec3u {
    return vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u);
}

fn cell_weight(position: SkyPosition, corner: vec3u) -> f32 {
    let w = mix(1.0 - position.upper, position.upper, vec3f(corner));
    return w.x * w.y * w.z;
}

fn sky_transmittance_at(grid: SkyGrid, p: vec3f) -> SkyTransmittance {
    let clear = vec4f(vec3f(0.0), 1.0);
    if (any(grid.cell <= vec3f(0.0))) {
        return SkyTransmittance(clear, clear);
    }
    let position = sky_position(grid, p);
    var sum = SkyTransmittance(vec4f(0.0), vec4f(0.0));
    for (var k = 0u; k < 8u; k += 1u) {
        let w = cell_weight(position, cell_corner(k));
        let one = sky_transmittance_of(position.low + cell_corner(k));
        sum.hair += w * one.hair;
        sum.all += w * one.all;
    }
    return SkyTransmittance(mix(sum.hair, clear, position.outside), mix(sum.all, clear, position.outside));
}

// Light of the environment that passes hair and reaches a surface, in units of `received`.
// open: the same without hair
fn received_past_hair(grid: SkyGrid, p: vec3f, normal: vec3f, open: f32) -> f32 {
    if (any(grid.cell <= vec3f(0.0))) {
        return open;
    }
    let position = sky_position(grid, p);
    var sum = 0.0;
    for (var k = 0u; k < 8u; k += 1u) {
        let moments = sky_moments_of(position.low + cell_corner(k));
        sum += cell_weight(position, cell_corner(k)) * received(moments, normal);
    }
    return mix(sum, open, position.outside);
}

// Mean depth of the strands between a point and an area light, behind the nearest strand of the window; negative if there are none.
// at: position of the point in the window; reach: half sides of the area that is searched [texel]
fn blocker_depth(light: Light, at: vec3f, reach: vec2f) -> f32 {
    var sum = 0.0;
    var count = 0.0;
    for (var k = 0u; k < BLOCKER_POINTS; k += 1u) {
        let texel = vec2i(floor(at.xy + reach * sample_point(k, light.round != 0u)));
        let nearest = strand_shadows[texel_word(light.layer, vec2u(clamp(texel, vec2i(0), vec2i(window_size()) - 1)))];
        let depth = f32(nearest) / DEPTH_SCALE;
        if (nearest != NO_HAIR && depth + AMONG_MM < at.z) {
            sum += depth;
            count += 1.0;
        }
    }
    return select(-1.0, sum / count, count > 0.0);
}

// Fraction of an area light that strands transmit to a point: the penumbra is as wide as the light seen past the strands before
// the point. Source: [Fernando2005].
fn soft_strand_transmittance(light: Light, p: vec3f) -> f32 {
    let window = window_of(light.layer);
    let at = project_to_map(light, p);
    if (any(window.size <= vec2f(0.0)) || at.z < window.depth) {
        return 1.0;
    }
    let position = to_window(window, at);
    let clip_per_spread = 2.0 * light.extent / (light.texel * vec2f(textureDimensions(shadow_maps)));
    let texels_per_spread = clip_per_spread / window.size * vec2f(window_size());
    let blocker = blocker_depth(light, position, ray_spread(light, window.depth, at.z) * texels_per_spread);
    if (blocker < 0.0) {
        return 1.0;
    }
    let reach = ray_spread(light, window.depth + blocker, at.z) * texels_per_spread;
    var sum = 0.0;
    for (var k = 0u; k < PENUMBRA_POINTS; k += 1u) {
        let texel = vec2i(floor(position.xy + reach * sample_point(k, light.round != 0u)));
        sum += exp(-cover_before(light.layer, texel, position.z - AMONG_MM));
    }
    return sum / f32(PENUMBRA_POINTS);
}

// Fraction of a light that strands transmit to a point.
fn strand_transmittance(light: Light, p: vec3f) -> f32 {
    if (SHAPES && STRANDS && light.layer >= 0 && any(light.extent > vec2f(0.0))) {
        return soft_strand_transmittance(light, p);
    }
    return exp(-strand_cover(light, p));
}
