// Weight of each translucent pair: the fraction of light that crosses the tissue, minus the fraction that blurs over the atlas
// already carry along the surface.
//#include "translucent_pair.wgsl"
//#include "packed_pair.wgsl"

override COUNT: u32 = 8u; // number of Gaussians, a constant so that software adapters unroll the loop
override TABLES: bool = false; // whether transmittance is read from a table by thickness; else it is a Gaussian of the straight distance

const ROWS: u32 = 32u; // of the table, see optics/thin_parts.py

struct PairProfile {
    radius_mm: f32, // largest distance of a pair
    source_mm2: f32, // variance of the blurred level that sources sample
    cell_mm2: f32, // usual area of a source
    min_variance_ratio: f32, // least ratio of the added variance to the area of the source, which hides the pattern of the sources
    reach_mm: f32, // thickness of the last row of the table
    gaussian: array<vec4f, 24>, // weights of the blurred level in three channels, variance [mm^2]
}

@group(0) @binding(0) var<uniform> pair_profile: PairProfile;
@group(0) @binding(1) var<storage, read> pairs: array<u32>; // three words: source, receiver, offset in the atlas [1/8 texel]
@group(0) @binding(2) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(3) var<storage, read> source_points: array<Source>;
@group(0) @binding(4) var<storage, read_write> weights: array<vec2u>; // packed source and directionality, see packed_pair.wgsl; encoded weight
// Transmittance by Gaussian: COUNT values of each row; rows are evenly spaced in the root of the thickness. w of the first value
// is the directionality. Not a uniform buffer, from which invocations that read different rows would read one after another.
@group(0) @binding(5) var<storage, read> transmittance: array<vec4f>;

const ROW: u32 = 1024u; // pairs of a row of workgroups
const PI: f32 = 3.14159265358979;
const FINE: f32 = 8.0; // parts of a texel
const FAR_MM2: f32 = 1e12; // squared distance that counts as infinite
const MIN_DISC: f32 = 0.3; // least fraction of a Gaussian within the largest distance of pairs; it is divided by that fraction

// Three weights with a common exponent: nine bits each and five.
fn encode(c: vec3f) -> u32 {
    let largest = max(c.r, max(c.g, c.b));
    if (largest < exp2(-24.0)) {
        return 0u;
    }
    let e = clamp(i32(floor(log2(largest))) + 16, 0, 31);
    let m = min(vec3u(round(c * exp2(f32(24 - e)))), vec3u(511u));
    return m.r | (m.g << 9u) | (m.b << 18u) | (u32(e) << 27u);
}

// Squared distance along the surface for an offset in the atlas [mm^2].
fn along_distance2(offset: u32, metric: vec3f, area: f32) -> f32 {
    let by = vec2f(f32(bitcast<i32>(offset << 16u) >> 16u), f32(bitcast<i32>(offset) >> 16u));
    let square = dot(metric, vec3f(by * by, 2.0 * by.x * by.y)) / (FINE * FINE);
    return select(square + area / 6.0, FAR_MM2, offset == NO_OFFSET || square >= pair_profile.radius_mm * pair_profile.radius_mm);
}

// Weight of a Gaussian in the light that a thickness transmits.
fn transmittance_at(k: u32, row: f32) -> vec3f {
    let low = min(u32(row), ROWS - 2u);
    let near = transmittance[low * COUNT + k].rgb;
    return mix(near, transmittance[(low + 1u) * COUNT + k].rgb, row - f32(low));
}

fn table_row(depth2: f32) -> f32 {
    return f32(ROWS - 1u) * sqrt(min(sqrt(depth2) / pair_profile.reach_mm, 1.0));
}

fn directionality_at(depth2: f32) -> f32 {
    let row = table_row(depth2);
    let low = min(u32(row), ROWS - 2u);
    return mix(transmittance[low * COUNT].w, transmittance[(low + 1u) * COUNT].w, row - f32(low));
}

// A Gaussian of the distance sqrt(t^2 + r^2) is exp(-t^2 / 2v) G(v, r) [dEonLuebke2007]. The variance of the light at the sources
// is subtracted, and so is what the blur along the surface brings to the receiver.
fn transmitted_light(depth2: f32, lateral2: f32, along2: f32, area: f32) -> vec3f {
    let edge2 = max(pair_profile.radius_mm * pair_profile.radius_mm - depth2, 0.0);
    let row = table_row(depth2);
    var sum = vec3f(0.0);
    for (var k = 0u; k < COUNT; k++) {
        let gaussian = pair_profile.gaussian[k];
        let w = max(gaussian.w - pair_profile.source_mm2, pair_profile.min_variance_ratio * max(area, pair_profile.cell_mm2));
        let disc = max(1.0 - exp(-0.5 * edge2 / w), MIN_DISC);
        let along = exp(-0.5 * along2 / w);
        if (TABLES) {
            sum += (transmittance_at(k, row) * (exp(-0.5 * lateral2 / w) / disc)) / w;
        } else {
            let straight = exp(-0.5 * (depth2 / gaussian.w + lateral2 / w)) / disc;
            sum += gaussian.rgb * max(0.0, straight - along) / w;
        }
    }
    return area / (2.0 * PI) * max(sum, vec3f(0.0));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (index >= arrayLength(&weights)) {
        return;
    }
    let number = pairs[3u * index];
    let receiver = receiver_points[pairs[3u * index + 1u]];
    let source = source_points[number];
    let geometry = pair_geometry(receiver.position, receiver.normal, source);
    let near = geometry.distance2 < pair_profile.radius_mm * pair_profile.radius_mm;
    let fraction = select(0.0, pair_fraction(geometry.cosine, geometry.inward), near);
    let depth2 = geometry.depth * geometry.depth;
    let along2 = along_distance2(pairs[3u * index + 2u], receiver.metric, source.area);
    let light = transmitted_light(depth2, max(geometry.distance2 - depth2, 0.0), along2, source.area);
    var directionality = 0.0;
    if (TABLES) {
        directionality = directionality_at(depth2);
    }
    weights[index] = vec2u(pack_pair(number, directionality), encode(fraction * light));
}
