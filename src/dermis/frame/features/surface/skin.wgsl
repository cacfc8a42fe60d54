// Maps of the skin: colour, gloss, and relief as a surface gradient.
//#include "surface.wgsl"

@group(0) @binding(3) var map_sampler: sampler;
@group(0) @binding(4) var colour_map: texture_2d<f32>; // filtered
@group(0) @binding(5) var slope_map: texture_2d<f32>; // filtered: mean slopes along +u, +v-up; their squares
@group(0) @binding(6) var relief_map: texture_2d<f32>; // filtered: mean mm per texel along u, v; their squares
@group(0) @binding(7) var specular_map: texture_2d<f32>; // filtered: factor of rho_s
@group(0) @binding(8) var roughness_map: texture_2d<f32>; // filtered: factor of the roughness

//#if PARTS
//#else
@group(0) @binding(14) var detail_map: texture_2d_array<f32>; // filtered, a tile: slopes of pores and of lines; their squares, and their cavities less the mean
@group(0) @binding(15) var detail_sampler: sampler;
//#end

override DETAIL: bool = false; // whether the skin has relief finer than its maps
//#fill const TILE_MM: f32 = {tile_mm};
// Artistic values: part of the colour and of the reflection that the deepest cavities lose.
const CAVITY_COLOUR: vec3f = vec3f(0.16, 0.30, 0.32);
const CAVITY_GLOSS: f32 = 0.65;
const TURN_STEP: f32 = 0.7853982; // angle between the orientations in which the tile is used

// Relief finer than the maps.
struct Detail {
    slope: vec2f, // along u and down
    spread: f32, // variance of slopes finer than the footprint
    cavity: f32, // depth of cavities less its mean over the skin
}

struct Surface {
    normal: vec3f, // with the relief
    colour: vec3f,
    roughness: f32,
    rho_s: f32,
}

fn mip_for(image: texture_2d<f32>, footprint: f32) -> f32 {
    let size = vec2f(textureDimensions(image));
    return max(0.0, log2(footprint * max(size.x, size.y)));
}

// Surface at a point, filtered over `footprint`, relative to the side of the uv square. Finer relief widens the lobe by its
// slope variance [OlanoBaker2010].
fn surface_at(point: Point, footprint: f32) -> Surface {
    let length_u = length(point.dpdu);
    let length_v = length(point.dpdv);
    let s = textureSampleLevel(slope_map, map_sampler, point.uv, mip_for(slope_map, footprint));
    // the height map adds only relief finer than the normal map: usually both have the same source
    let size = vec2f(textureDimensions(relief_map));
    var mip = mip_for(relief_map, footprint);
    var coarse = vec4f(0.0);
    if (skin.relief_band >= 0.0) {
        mip = min(mip, skin.relief_band);
        coarse = textureSampleLevel(relief_map, map_sampler, point.uv, skin.relief_band);
    }
    let fine = textureSampleLevel(relief_map, map_sampler, point.uv, mip);
    let gradient = (fine.xy - coarse.xy) * size + vec2f(s.x * length_u, -s.y * length_v);
    let per_mm = size / max(vec2f(length_u, length_v), vec2f(1e-3));
    let spread = max(s.zw - s.xy * s.xy, vec2f(0.0)) + max(fine.zw - fine.xy * fine.xy, vec2f(0.0)) * per_mm * per_mm;
    let rough = textureSampleLevel(roughness_map, map_sampler, point.uv, mip_for(roughness_map, footprint));
    let gloss = textureSampleLevel(specular_map, map_sampler, point.uv, mip_for(specular_map, footprint));
    var finest = Detail(vec2f(0.0), 0.0, 0.0);
    if (DETAIL) {
        finest = detail_at(point.uv, footprint, vec2f(gloss.y, rough.y), gloss.z, gloss.w);
    }
    let m = skin.m * rough.x;
    var out: Surface;
    out.normal = bend(point, gradient + finest.slope * vec2f(length_u, length_v));
    out.colour = textureSampleLevel(colour_map, map_sampler, point.uv, mip_for(colour_map, footprint)).rgb;
    out.roughness = clamp(widened(max(m, 1e-3), spread.x + spread.y + finest.spread), 0.05, 1.0);
    out.rho_s = skin.specular_strength * gloss.x;
    if (DETAIL) {
        //#if BANDS
        out.colour *= 1.0 - in_channels(CAVITY_COLOUR) * finest.cavity;
        //#else
        out.colour *= 1.0 - CAVITY_COLOUR * finest.cavity;
        //#end
        out.rho_s *= max(1.0 - CAVITY_GLOSS * finest.cavity, 0.2);
    }
    return out;
}

//#if PARTS
// Heads with parts from files have no relief finer than their maps.
fn detail_at(uv: vec2f, footprint: f32, amounts: vec2f, density: f32, tension: f32) -> Detail {
    return Detail(vec2f(0.0), 0.0, 0.0);
}
//#else
// amounts : of pores and lines; density : log2 of the mm per unit of uv; tension : direction of the tension lines, from +u to down
// Tiles are scaled by powers of two, so that pores have their true size to a factor of 1.4 in all charts, and turned by multiples of
// TURN_STEP, as an angle that varies continuously would shear them.
fn detail_at(uv: vec2f, footprint: f32, amounts: vec2f, density: f32, tension: f32) -> Detail {
    let level = vec2f(density - log2(TILE_MM), tension / TURN_STEP);
    let first = floor(level);
    let part = smoothstep(vec2f(0.4, 0.35), vec2f(0.6, 0.65), level - first);
    var found = Detail(vec2f(0.0), 0.0, 0.0);
    var k = 0u;
    loop { // over the scales and angles that have a weight; nested loops, as software adapters run both sides of a branch
        var next = vec2f(0.0);
        var weight = 0.0;
        loop {
            if (k >= 4u) {
                break;
            }
            next = vec2f(f32(k & 1u), f32(k >> 1u));
            let shares = mix(1.0 - part, part, next);
            weight = shares.x * shares.y;
            if (weight > 0.0) {
                break;
            }
            k++;
        }
        if (k >= 4u) {
            break;
        }
        let one = tiled(uv, footprint, amounts, exp2(first.x + next.x), TURN_STEP * (first.y + next.y));
        found.slope += weight * one.slope;
        found.spread += weight * one.spread;
        found.cavity += weight * one.cavity;
        k++;
    }
    return found;
}

fn tiled(uv: vec2f, footprint: f32, amounts: vec2f, tiles: f32, turn: f32) -> Detail {
    let mip = max(0.0, log2(footprint * tiles * f32(textureDimensions(detail_map).x)));
    let turned = mat2x2f(cos(turn), -sin(turn), sin(turn), cos(turn));
    let place = tiles * (turned * uv);
    let slopes = textureSampleLevel(detail_map, detail_sampler, place, 0, mip);
    let moments = textureSampleLevel(detail_map, detail_sampler, place, 1, mip);
    let hidden = max(moments.xy - vec2f(dot(slopes.xy, slopes.xy), dot(slopes.zw, slopes.zw)), vec2f(0.0));
    let slope = (amounts.x * slopes.xy + amounts.y * slopes.zw) * turned;
    return Detail(slope, dot(amounts * amounts, hidden), dot(amounts, moments.zw));
}
//#end

// Colour map applied before (mix) or after (1 - mix) scattering; black is clamped, as pow(0, 0) is undefined.
fn colour_power(colour: vec3f, exponent: f32) -> vec3f {
    return pow(max(colour, vec3f(1e-8)), vec3f(exponent));
}

// Normal of a surface displaced by a height with this gradient over uv [mm]. Source: [Mikkelsen2010].
fn bend(point: Point, gradient: vec2f) -> vec3f {
    let n = point.normal;
    let across = cross(point.dpdv, n);
    let det = dot(point.dpdu, across);
    if (abs(det) < 1e-6) {
        return n;
    }
    let slope = (gradient.x * across + gradient.y * cross(n, point.dpdu)) / det;
    return normalize(n - slope);
}
