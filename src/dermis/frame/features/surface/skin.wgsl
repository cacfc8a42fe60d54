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
@group(0) @binding(14) var detail_map: texture_2d_array<f32>; // filtered, a tile: slopes of pores and of furrows, then their squares
@group(0) @binding(15) var detail_sampler: sampler;
//#end

override DETAIL: bool = false; // whether the skin has relief finer than its maps
//#fill const TILE_MM: f32 = {tile_mm};

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
    var finest = vec3f(0.0);
    if (DETAIL) {
        finest = detail_at(point.uv, footprint, vec2f(gloss.y, rough.y), gloss.z);
    }
    let m = skin.m * rough.x;
    var out: Surface;
    out.normal = bend(point, gradient + finest.xy * vec2f(length_u, length_v));
    out.colour = textureSampleLevel(colour_map, map_sampler, point.uv, mip_for(colour_map, footprint)).rgb;
    out.roughness = clamp(sqrt(m * m + spread.x + spread.y + finest.z), 0.05, 1.0);
    out.rho_s = skin.specular_strength * gloss.x;
    return out;
}

//#if PARTS
// Heads with parts from files have no relief finer than their maps.
fn detail_at(uv: vec2f, footprint: f32, amounts: vec2f, density: f32) -> vec3f {
    return vec3f(0.0);
}
//#else
// Slopes of pores and furrows along u and down, and the variance of slopes finer than the footprint.
// amounts : of pores and furrows; density : log2 of the mm per unit of uv
// Tiles are scaled by powers of two, so that pores have their true size to a factor of 1.4 in all charts.
fn detail_at(uv: vec2f, footprint: f32, amounts: vec2f, density: f32) -> vec3f {
    let level = density - log2(TILE_MM);
    let octave = floor(level);
    let part = smoothstep(0.4, 0.6, level - octave);
    var found = vec3f(0.0);
    if (part < 1.0) {
        found = (1.0 - part) * tiled(uv, footprint, amounts, exp2(octave));
    }
    if (part > 0.0) {
        found += part * tiled(uv, footprint, amounts, exp2(octave + 1.0));
    }
    return found;
}

fn tiled(uv: vec2f, footprint: f32, amounts: vec2f, tiles: f32) -> vec3f {
    let mip = max(0.0, log2(footprint * tiles * f32(textureDimensions(detail_map).x)));
    let slopes = textureSampleLevel(detail_map, detail_sampler, tiles * uv, 0, mip);
    let squares = textureSampleLevel(detail_map, detail_sampler, tiles * uv, 1, mip).xy;
    let hidden = max(squares - vec2f(dot(slopes.xy, slopes.xy), dot(slopes.zw, slopes.zw)), vec2f(0.0));
    return vec3f(amounts.x * slopes.xy + amounts.y * slopes.zw, dot(amounts * amounts, hidden));
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
