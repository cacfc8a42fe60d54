// Attributes of a texel of the skin's maps: position on the average person, noise, zones and dots.
//#include "painted_surface.wgsl"
//#include "noise.wgsl"

//#each noises: const NOISE_{NAME}: u32 = {number};
//#each dots: const DOT_{NAME}: u32 = {number};
//#each amounts: const ZONE_{NAME}: u32 = {number};
//#each grounds: const GROUND_{NAME}: u32 = {number};
//#fill const NOISES: u32 = {noises}u;
//#fill const NOISE_ROWS: u32 = {noise_rows}u;
//#fill const WANDER_ROWS: u32 = {wander_rows}u;
//#fill const DOTS: u32 = {dots}u;
//#fill const AMOUNT_ROWS: u32 = {amount_rows}u;
//#fill const ZONES: u32 = {zones}u;
//#fill const FOLDS: u32 = {folds}u;
//#fill const FOLDING: u32 = {folding}u;
//#fill const EDGES: u32 = {edges}u;
//#fill const DEGREES: f32 = {degrees};

struct Noise {
    x: vec4f, // x, y and z: rows of the matrix to the lattice; x.w: feature size [mm], 0 for noise that is never filtered
    y: vec4f, // y.w: strength
    z: vec4f, // z.w: seed, as bits
    which: vec4f, // noise, space and region, as bits
}

struct Zone {
    centre: vec4f, // [mm]
    inverse_radii: vec4f, // [1/mm]
    //#fill amounts: array<vec4f, {amount_rows}>,
}

struct Fold {
    ball: vec4f, // centre and radius [mm]
    size: vec4f, // width, depth in a young and in an old face [mm]; number of the movement that deepens it, or 0
    knots: vec4f, // first and last index
}

struct Tables {
    //#fill noises: array<Noise, {noise_rows}>,
    //#fill dot_kinds: array<Dots, {dots}>,
    //#fill zones: array<Zone, {zones}>,
    //#fill folds: array<Fold, {folds}>,
    //#fill knots: array<vec4f, {knots}>, // positions [mm], and position along the fold
    //#fill hairline: array<vec4f, {edges}>, // height of this and of the next entry [mm]
}

@group(0) @binding(4) var<uniform> tables: Tables; // uniform, as software adapters read storage buffers more slowly

// Artistic values.
const WANDER_MM: f32 = 5.0; // displacement of the borders of zones
const LIP_WANDER_MM: f32 = 0.45; // displacement of the border of the lips
const LIP_MM: vec2f = vec2f(-1.1, 1.3); // distances inside the border of the lips between which skin turns into lips
const HAIRLINE_MM: vec2f = vec2f(-6.0, 11.0); // heights above the hairline between which hair becomes dense
const HAIRLINE_WANDER_MM: vec2f = vec2f(5.0, 4.0);
const LOWEST_HAIR_MM: f32 = -80.0;
const EYE: vec2f = vec2f(29.5, -0.5); // centre of the lines around an eye [mm]
const HEAD_AXIS_Z: f32 = -72.0;

const FOLD_WANDER_MM: f32 = 2.4;
const FOLD_REACH: f32 = 6.0; // distance at which a fold ends, in widths of the fold

// Attributes of a texel.
struct Spot {
    body: vec3f, // position on the average person [mm]
    left: vec3f, // the same, mirrored to the left half
    normal: vec3f,
    fields: vec3f,
    texel_mm: f32,
    density: f32,
}

var<private> noise: array<f32, NOISES>;
var<private> dotted: array<f32, DOTS>;
var<private> zone: array<vec4f, AMOUNT_ROWS>;

fn zone_of(amount: u32) -> f32 {
    return zone[amount / 4u][amount % 4u];
}

fn spot_of(owner: u32, at: vec2u) -> Spot {
    let t = triangle_of((owner & ((1u << ID_BITS) - 1u)) - 1u);
    let a = vertex_of(t.x);
    let b = vertex_of(t.y);
    let c = vertex_of(t.z);
    let p = (vec2f(at) + 0.5) / f32(paint.side);
    let ab = b.uv - a.uv;
    let ac = c.uv - a.uv;
    let ap = p - a.uv;
    let w = vec2f(ap.x * ac.y - ap.y * ac.x, ab.x * ap.y - ab.y * ap.x) / (ab.x * ac.y - ab.y * ac.x);
    let u = 1.0 - w.x - w.y;
    let position = u * a.position + w.x * b.position + w.y * c.position;
    let normal = normalize(u * a.normal + w.x * b.normal + w.y * c.normal);
    let density = u * a.density + w.x * b.density + w.y * c.density;
    let fields = u * a.fields + w.x * b.fields + w.y * c.fields;
    return Spot(position, vec3f(abs(position.x), position.yz), normal, fields, exp2(density) / f32(paint.side), density);
}

// Position at which a noise is evaluated; earlier noises displace later ones.
fn in_space(spot: Spot, space: u32) -> vec3f {
    let p = spot.body;
    switch (space) {
        case 1u: {
            return p + vec3f(0.45 * noise[NOISE_CREASE_BEND] + 0.02 * p.x * abs(spot.fields.y), 0.0, 0.0);
        }
        case 2u: {
            return p + vec3f(0.0, 0.8 * noise[NOISE_LINE_BEND], 0.0);
        }
        case 3u: {
            let off = (spot.left.xy - EYE) * vec2f(1.0, 1.25);
            return vec3f(length(off) + 0.8 * noise[NOISE_LINE_BEND], p.xy);
        }
        default: {
            return p;
        }
    }
}

// Amplitude of a row of noise at a texel.
// grounds : bits of the regions of the texel; noise of other regions is 0
fn amplitude(row: u32, texel_mm: f32, grounds: u32) -> f32 {
    let blob_mm = tables.noises[row].x.w;
    let here = (grounds & (1u << bitcast<u32>(tables.noises[row].which.z))) != 0u;
    return select(0.0, select(visible(blob_mm, texel_mm), 1.0, blob_mm == 0.0), here);
}

// Noise of all sizes, for a range of rows. Rows without effect are skipped in an inner loop, because software adapters
// execute both sides of branches.
fn make_noise(spot: Spot, first: u32, end: u32, grounds: u32) {
    var k = first;
    loop {
        var strength = 0.0;
        loop {
            if (k >= end) {
                break;
            }
            strength = amplitude(k, spot.texel_mm, grounds);
            if (strength > 0.0) {
                break;
            }
            k++;
        }
        if (k >= end) {
            break;
        }
        let one = tables.noises[k];
        let p = in_space(spot, bitcast<u32>(one.which.y));
        let lattice = vec3f(dot(one.x.xyz, p), dot(one.y.xyz, p), dot(one.z.xyz, p));
        let seed = bitcast<u32>(one.z.w) + 64u * paint.seed;
        noise[bitcast<u32>(one.which.x)] += one.y.w * strength * gradient_noise(lattice, seed);
        k++;
    }
}

// All noise of a texel. Zones come first, as some noise is limited to zones.
fn make_textures(spot: Spot) {
    for (var k = 0u; k < NOISES; k++) {
        noise[k] = 0.0;
    }
    make_noise(spot, 0u, WANDER_ROWS, 1u << GROUND_ALL);
    sum_zones(spot);
    make_noise(spot, WANDER_ROWS, NOISE_ROWS, grounds_of(spot));
}

// Bits of the regions that contain a texel; regions are extended by the largest displacement of their borders.
fn grounds_of(spot: Spot) -> u32 {
    let lips = spot.fields.x > LIP_MM.x - LIP_WANDER_MM * MAX_NOISE;
    let lines = zone_of(ZONE_LEVEL) != 0.0 || zone_of(ZONE_AROUND) != 0.0;
    let veined = zone_of(ZONE_VEINS) > 0.0 && paint.veins > 0.0;
    let above = above_hairline(spot);
    let bent = MAX_NOISE * (HAIRLINE_WANDER_MM.x + HAIRLINE_WANDER_MM.y);
    let edge = spot.left.y >= LOWEST_HAIR_MM && above > HAIRLINE_MM.x - bent && above < HAIRLINE_MM.y + bent;
    let folds = near_folds(spot);
    return (1u << GROUND_ALL)
        | (u32(lips) << GROUND_LIPS)
        | (u32(lines) << GROUND_LINES)
        | (u32(lines || folds) << GROUND_FURROWS)
        | (u32(folds) << GROUND_FOLDS)
        | (u32(veined) << GROUND_VEINS)
        | (u32(edge) << GROUND_HAIRLINE);
}

fn width_of(fold: Fold, texel_mm: f32) -> f32 {
    return sqrt(fold.size.x * fold.size.x + 0.64 * texel_mm * texel_mm);
}

// Whether a fold can reach a texel, however noise displaces it.
fn near_folds(spot: Spot) -> bool {
    var near = false;
    for (var k = 0u; k < FOLDS; k++) {
        let fold = tables.folds[k];
        let reach = fold.ball.w + FOLD_REACH * width_of(fold, spot.texel_mm) + 1.5 * MAX_NOISE * FOLD_WANDER_MM;
        near = near || distance(spot.left, fold.ball.xyz) < reach;
    }
    return near;
}

fn sum_zones(spot: Spot) {
    for (var k = 0u; k < AMOUNT_ROWS; k++) {
        zone[k] = vec4f(0.0);
    }
    let p = spot.left + WANDER_MM * vec3f(noise[NOISE_WANDER_X], noise[NOISE_WANDER_Y], 0.0);
    var k = 0u;
    loop { // over the zones that reach this texel; nested loops as in make_noise
        var away = 0.0;
        loop {
            if (k >= ZONES) {
                break;
            }
            let off = (p - tables.zones[k].centre.xyz) * tables.zones[k].inverse_radii.xyz;
            away = dot(off, off);
            if (away < 14.0) {
                break;
            }
            k++;
        }
        if (k >= ZONES) {
            break;
        }
        let weight = exp(-away);
        for (var c = 0u; c < AMOUNT_ROWS; c++) {
            zone[c] += weight * tables.zones[k].amounts[c];
        }
        k++;
    }
}

fn above_hairline(spot: Spot) -> f32 {
    let p = spot.left;
    let angle = degrees(atan2(p.x, p.z - HEAD_AXIS_Z)) / DEGREES;
    let before = min(u32(angle), EDGES - 2u);
    let heights = tables.hairline[before];
    let edge = mix(heights.x, heights.y, angle - f32(before));
    return p.y - edge;
}

fn scalp_at(spot: Spot) -> f32 {
    if (spot.left.y < LOWEST_HAIR_MM) {
        return 0.0;
    }
    let bent = HAIRLINE_WANDER_MM * vec2f(noise[NOISE_HAIRLINE], noise[NOISE_FINE_HAIRLINE]);
    let above = above_hairline(spot) + bent.x + bent.y;
    return smoothstep(HAIRLINE_MM.x, HAIRLINE_MM.y, above) * saturate(1.0 + zone_of(ZONE_HAIR));
}
