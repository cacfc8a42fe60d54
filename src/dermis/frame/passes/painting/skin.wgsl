// Colour, relief and gloss of the skin at each texel of its maps, from pigments, marks and lines of the face.
//#include "painted_surface.wgsl"
//#include "noise.wgsl"

//#each noises: const NOISE_{NAME}: u32 = {number};
//#each dots: const DOT_{NAME}: u32 = {number};
//#each amounts: const ZONE_{NAME}: u32 = {number};
//#fill const NOISES: u32 = {noises}u;
//#fill const NOISE_ROWS: u32 = {noise_rows}u;
//#fill const DOTS: u32 = {dots}u;
//#fill const AMOUNTS: u32 = {amounts}u;
//#fill const ZONES: u32 = {zones}u;
//#fill const FOLDS: u32 = {folds}u;
//#fill const KNOTS: u32 = {knots}u;
//#fill const EDGES: u32 = {edges}u;
//#fill const DEGREES: f32 = {degrees};

struct Noise {
    x: vec4f, // rows of the matrix to the lattice; the size of texel that shows it [mm], 0 for always
    y: vec4f, // strength
    z: vec4f, // seed, as bits
    which: vec4f, // noise and space, as bits
}

struct Zone {
    centre: vec4f, // [mm]
    reach: vec4f, // one over the radii
    amounts: array<f32, AMOUNTS>,
}

struct Fold {
    ball: vec4f, // centre and radius [mm]
    size: vec4f, // width, depth in a young and in an old face [mm], movement
}

struct Tables {
    noises: array<Noise, NOISE_ROWS>,
    dot_kinds: array<Dots, DOTS>,
    zones: array<Zone, ZONES>,
    folds: array<Fold, FOLDS>,
    knots: array<vec4f, KNOTS>, // places [mm], how far along
    firsts: array<f32, FOLDS + 1u>, // where folds begin in the knots
    hairline: array<f32, EDGES>, // heights [mm]
}

@group(0) @binding(3) var<storage, read> owners: array<u32>;
@group(0) @binding(4) var<storage, read> tables: Tables;
@group(0) @binding(10) var colour_tables: texture_2d_array<f32>; // of skin and of lips, by roots of blood and of melanin
@group(0) @binding(11) var colour: texture_storage_2d<rgba16float, write>;
@group(0) @binding(12) var specular: texture_storage_2d<rgba16float, write>;
@group(0) @binding(13) var roughness: texture_storage_2d<rgba16float, write>;
@group(0) @binding(14) var<storage, read_write> heights: array<f32>; // with a texel more on all sides [mm]

// Artist's values.
const WANDER_MM: f32 = 5.0; // of the zones' borders
const PATCHES: f32 = 0.22; // of melanin [doublings]
const BLOTCHES: f32 = 0.40; // of blood
const FRECKLE: f32 = 1.7;
const AGE_SPOT: f32 = 1.3;
const MOLE: f32 = 3.4;
const TAN: f32 = 1.2; // from under clothes to where the sun shines most
const LIP_BLOOD: f32 = 1.9;
const LIP_MELANIN: f32 = 0.5;
const MUCOSA_BLOOD: f32 = 3.2;
const RED_LIDS: f32 = 0.8;
const RED_SLIT: f32 = 1.0;
const STUBBLE_COLOUR: vec3f = vec3f(0.095, 0.085, 0.08); // hair seen through skin, which makes it blueish
const BEARD_COLOUR: vec3f = vec3f(0.11, 0.10, 0.095);
const VEIN_COLOUR: vec3f = vec3f(0.80, 0.90, 1.0); // factor
const STRENGTH: f32 = 0.155;
const OILY_STRENGTH: f32 = 0.08;
const ROUGHNESS: f32 = 0.36;
const OILY_ROUGHNESS: f32 = -0.10;
const LIP_STRENGTH: f32 = 0.05;
const LIP_ROUGHNESS: f32 = -0.07;
const WET_STRENGTH: f32 = 0.10; // of the inside of the mouth and the lids' edges
const WET_ROUGHNESS: f32 = -0.12;
const UNEVEN: f32 = 0.15; // of the oil
const GRAIN_MM: f32 = 0.040;
const LINE_MM: f32 = 0.07;
const LIP_MM: f32 = 0.16;
const MOLE_MM: f32 = 0.18;
const FOLD_WANDER_MM: f32 = 2.4;
const FOLD_REACH: f32 = 6.0; // in widths
const EYE: vec2f = vec2f(29.5, -0.5); // that lines run around [mm]
const HEAD_AXIS_Z: f32 = -72.0;

// What is known of a texel.
struct Spot {
    body: vec3f, // place on the average person [mm]
    left: vec3f, // the same on its left half
    normal: vec3f,
    fields: vec4f,
    texel_mm: f32,
    density: f32,
}

var<private> noise: array<f32, NOISES>;
var<private> dotted: array<f32, DOTS>;
var<private> zone: array<f32, AMOUNTS>;

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
    let place = u * a.place + w.x * b.place + w.y * c.place;
    let normal = normalize(u * a.normal + w.x * b.normal + w.y * c.normal);
    let density = u * a.density + w.x * b.density + w.y * c.density;
    let fields = u * a.fields + w.x * b.fields + w.y * c.fields;
    return Spot(place, vec3f(abs(place.x), place.yz), normal, fields, exp2(density) / f32(paint.side), density);
}

// Where a noise is looked up; later ones are bent by those before.
fn in_space(spot: Spot, space: u32) -> vec3f {
    let p = spot.body;
    switch (space) {
        case 1u: {
            return p + vec3f(0.9 * noise[NOISE_CREASE_BEND] + 0.02 * p.x * abs(spot.fields.y), 0.0, 0.0);
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

fn make_noise(spot: Spot) {
    for (var k = 0u; k < NOISES; k++) {
        noise[k] = 0.0;
    }
    for (var k = 0u; k < NOISE_ROWS; k++) {
        let one = tables.noises[k];
        let shown = select(visible(one.x.w, spot.texel_mm), 1.0, one.x.w == 0.0);
        if (shown > 0.0) {
            let p = in_space(spot, bitcast<u32>(one.which.y));
            let lattice = vec3f(dot(one.x.xyz, p), dot(one.y.xyz, p), dot(one.z.xyz, p));
            let seed = bitcast<u32>(one.z.w) + 64u * paint.seed;
            noise[bitcast<u32>(one.which.x)] += one.y.w * shown * gradient_noise(lattice, seed);
        }
    }
}

fn sum_zones(spot: Spot) {
    for (var k = 0u; k < AMOUNTS; k++) {
        zone[k] = 0.0;
    }
    let p = spot.left + WANDER_MM * vec3f(noise[NOISE_WANDER_X], noise[NOISE_WANDER_Y], 0.0);
    for (var k = 0u; k < ZONES; k++) {
        let off = (p - tables.zones[k].centre.xyz) * tables.zones[k].reach.xyz;
        let away = dot(off, off);
        if (away < 14.0) {
            let weight = exp(-away);
            for (var c = 0u; c < AMOUNTS; c++) {
                zone[c] += weight * tables.zones[k].amounts[c];
            }
        }
    }
}

fn scatter_dots(spot: Spot, scalp: f32, lip: f32) {
    var kept: array<f32, DOTS>;
    let sun = saturate(zone[ZONE_SUN]);
    let freckled = paint.freckles * (0.12 + 0.88 * sun) * (0.75 + 0.75 * noise[NOISE_SUN]) * (1.0 - lip);
    kept[DOT_FRECKLES] = 0.7 * freckled;
    kept[DOT_SMALL_FRECKLES] = freckled;
    kept[DOT_MOLES] = 0.3 * paint.moles * (1.0 - lip);
    kept[DOT_AGE_SPOTS] = 0.8 * paint.spots * (0.1 + 0.9 * sun) * (1.0 - lip);
    kept[DOT_STUBBLE] = select(0.0, 1.0, max(scalp * paint.stubble, saturate(zone[ZONE_BEARD]) * paint.beard) > 0.0);
    for (var k = 0u; k < DOTS; k++) {
        dotted[k] = 0.0;
        if (kept[k] > 0.0) {
            let kind = tables.dot_kinds[k];
            let bent = spot.body + kind.ragged_mm * vec3f(noise[NOISE_RAGGED_X], noise[NOISE_RAGGED_Y], 0.0);
            dotted[k] = dots(bent, spot.normal, kind, kept[k], spot.texel_mm, 64u * paint.seed + 40u + 2u * k);
        }
    }
}

fn scalp_at(spot: Spot) -> f32 {
    let p = spot.left;
    if (p.y < -80.0) {
        return 0.0;
    }
    let angle = degrees(atan2(p.x, p.z - HEAD_AXIS_Z)) / DEGREES;
    let before = min(u32(angle), EDGES - 2u);
    let edge = mix(tables.hairline[before], tables.hairline[before + 1u], angle - f32(before));
    let above = p.y - edge + 5.0 * noise[NOISE_HAIRLINE] + 4.0 * noise[NOISE_FINE_HAIRLINE];
    return smoothstep(-9.0, 16.0, above) * saturate(1.0 + zone[ZONE_HAIR]);
}

// The table's colour for shares of melanin and blood, bilinear in their roots.
fn colour_of(table: u32, melanin: f32, blood: f32) -> vec3f {
    let nodes = f32(textureDimensions(colour_tables).x);
    let place = sqrt(saturate(vec2f(blood, melanin))) * (nodes - 1.0);
    let before = min(floor(place), vec2f(nodes - 2.0));
    let part = place - before;
    let at = vec2u(before);
    let near = mix(entry(table, at), entry(table, at + vec2u(1u, 0u)), part.x);
    let far = mix(entry(table, at + vec2u(0u, 1u)), entry(table, at + vec2u(1u, 1u)), part.x);
    return mix(near, far, part.y);
}

fn entry(table: u32, at: vec2u) -> vec3f {
    return textureLoad(colour_tables, at, table, 0).rgb;
}

// Thin branching lines, where noise is near zero.
fn veins() -> f32 {
    let near = 1.0 - smoothstep(0.0, 0.10, abs(noise[NOISE_VEINS] + 0.08 * noise[NOISE_SUN]));
    return near * saturate(zone[ZONE_VEINS]) * paint.veins;
}

fn pigments(spot: Spot, lip: f32, mucosa: f32) -> vec2f {
    var brown = zone[ZONE_MELANIN] * (1.0 - lip) + LIP_MELANIN * lip + PATCHES * noise[NOISE_PATCHES];
    brown += FRECKLE * smoothstep(0.02, 0.3, dotted[DOT_FRECKLES] + 0.7 * dotted[DOT_SMALL_FRECKLES]);
    brown += AGE_SPOT * smoothstep(0.05, 0.4, dotted[DOT_AGE_SPOTS]) + MOLE * smoothstep(0.1, 0.6, dotted[DOT_MOLES]);
    let clothed = smoothstep(-165.0, -205.0, spot.body.y + 6.0 * noise[NOISE_WANDER_Y]);
    brown += TAN * paint.tan * (0.35 * saturate(zone[ZONE_SUN]) - 0.5 * clothed);
    var red = 2.0 * paint.redness * zone[ZONE_BLOOD] * (1.0 - lip) + BLOTCHES * noise[NOISE_BLOTCHES];
    let slit = RED_SLIT * (1.0 - smoothstep(0.0, 2.2, spot.fields.y));
    red += lip * (LIP_BLOOD + 0.3 * noise[NOISE_LIP_STREAKS] + slit) + mucosa * (MUCOSA_BLOOD - lip * (LIP_BLOOD + RED_SLIT));
    red += RED_LIDS * (1.0 - smoothstep(0.3, 1.8, spot.fields.z));
    brown -= 3.0 * mucosa;
    return vec2f(paint.melanin, paint.blood) * exp2(vec2f(brown, red));
}

fn over(below: vec3f, above: vec3f, share: f32) -> vec3f {
    return mix(below, min(above, below), share); // what is dark already does not turn lighter
}

// Depth of a groove where noise crosses zero, no sharper than texels can show.
fn groove(n: f32, sharpness: f32, texel_mm: f32, blob_mm: f32) -> f32 {
    let finest = min(sharpness, 0.45 * blob_mm / texel_mm);
    let side = max(1.0 - abs(n) * finest, 0.0);
    return side * side * finest / sharpness * visible(blob_mm, texel_mm);
}

fn relief(spot: Spot, lip: f32) -> f32 {
    let texel = spot.texel_mm;
    let bare = max(1.0 + zone[ZONE_FURROWS], 0.2) * (1.0 - 0.85 * lip);
    var height = bare * GRAIN_MM * (0.6 + 0.5 * noise[NOISE_ROUGHNESS]) * (noise[NOISE_GRAIN] + 0.9 * abs(noise[NOISE_LUMPS]));
    let uneven = max(0.45 + 0.9 * noise[NOISE_LINE_DEPTH], 0.0);
    let lines = zone[ZONE_LEVEL] * uneven * groove(noise[NOISE_LEVEL_LINES], 3.5, texel, 1.5)
        + zone[ZONE_AROUND] * (0.3 + uneven) * 0.9 * groove(noise[NOISE_EYE_LINES], 3.0, texel, 1.1);
    height -= (0.3 + 1.2 * paint.age) * LINE_MM * lines;
    let creases = (0.6 + 0.6 * noise[NOISE_CREASE_DEPTH]) * groove(noise[NOISE_CREASES], 2.2, texel, 1.7)
        + 0.3 * groove(noise[NOISE_FINE_CREASES], 2.5, texel, 0.8);
    height -= lip * LIP_MM * creases * smoothstep(0.2, 2.0, abs(spot.fields.y));
    return height + MOLE_MM * smoothstep(0.1, 0.6, dotted[DOT_MOLES]) + folded(spot);
}

// Furrows along the face's own lines, with the skin a little raised beside them.
fn folded(spot: Spot) -> f32 {
    var height = 0.0;
    let bend = vec3f(
        0.7 * noise[NOISE_FOLD_BEND_X] + 0.3 * noise[NOISE_FINE_FOLD_BEND],
        0.7 * noise[NOISE_FOLD_BEND_Y] - 0.3 * noise[NOISE_FINE_FOLD_BEND],
        0.0,
    );
    let p = spot.left + FOLD_WANDER_MM * bend;
    for (var k = 0u; k < FOLDS; k++) {
        let fold = tables.folds[k];
        let own = fold.size.x;
        let width = sqrt(own * own + 0.64 * spot.texel_mm * spot.texel_mm);
        if (distance(p, fold.ball.xyz) < fold.ball.w + FOLD_REACH * width) {
            let near = nearest(p, k);
            let square = near.x / (width * width);
            let shape = (0.35 * exp(-square / 7.0) - exp(-square)) * (1.0 - smoothstep(0.6 * 36.0, 36.0, square));
            let ends = 1.0 - pow(2.0 * near.y - 1.0, 4.0);
            let depth = mix(fold.size.y, fold.size.z, paint.age) * own / width * max(0.8 + 0.6 * noise[NOISE_LINE_DEPTH], 0.0);
            height += depth * ends * shape;
        }
    }
    return height;
}

// Squared distance to a fold [mm2], and how far along it that is.
fn nearest(p: vec3f, fold: u32) -> vec2f {
    var found = vec2f(1e9, 0.0);
    for (var k = u32(tables.firsts[fold]); k + 1u < u32(tables.firsts[fold + 1u]); k++) {
        let along = tables.knots[k + 1u] - tables.knots[k];
        let off = p - tables.knots[k].xyz;
        let t = saturate(dot(off, along.xyz) / dot(along.xyz, along.xyz));
        let away = off - t * along.xyz;
        let square = dot(away, away);
        if (square < found.x) {
            found = vec2f(square, tables.knots[k].w + t * along.w);
        }
    }
    return found;
}

// rho_s and roughness.
fn gloss(lip: f32, wet: f32, hair: f32) -> vec2f {
    let film = noise[NOISE_OIL_FILM] + 0.7 * noise[NOISE_FINE_FILM];
    let zones = 0.5 + 1.25 * paint.oil;
    var rho_s = STRENGTH + OILY_STRENGTH * paint.oil + zones * zone[ZONE_STRENGTH] + LIP_STRENGTH * lip + WET_STRENGTH * wet;
    rho_s *= (1.0 + UNEVEN * film) * (1.0 - 0.4 * hair);
    var m = ROUGHNESS + OILY_ROUGHNESS * paint.oil + zones * zone[ZONE_ROUGHNESS] + LIP_ROUGHNESS * lip + WET_ROUGHNESS * wet;
    m *= 1.0 - 0.5 * UNEVEN * film;
    return vec2f(clamp(rho_s, 0.05, 0.45), clamp(m, 0.15, 0.6));
}

fn keep(at: vec2u, rgb: vec3f, shine: vec2f, height: f32, amounts: vec3f) {
    textureStore(colour, at, vec4f(rgb, 1.0));
    textureStore(specular, at, vec4f(shine.x / paint.usual_strength, amounts.x, amounts.z, 0.0));
    textureStore(roughness, at, vec4f(shine.y, amounts.y, 0.0, 0.0));
    heights[(at.y + 1u) * (paint.side + 2u) + at.x + 1u] = height;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(paint.side))) {
        return;
    }
    let owner = owners[id.y * paint.side + id.x];
    if (owner == 0u) {
        let shine = vec2f(STRENGTH + OILY_STRENGTH * paint.oil, ROUGHNESS + OILY_ROUGHNESS * paint.oil);
        keep(id.xy, colour_of(0u, paint.melanin, paint.blood), shine, 0.0, vec3f(0.0));
        return;
    }
    let spot = spot_of(owner, id.xy);
    make_noise(spot);
    sum_zones(spot);
    let lip = smoothstep(-1.1, 1.3, spot.fields.x + 0.45 * noise[NOISE_LIP_EDGE]);
    let mucosa = smoothstep(0.5, -2.5, spot.fields.y);
    let scalp = scalp_at(spot);
    scatter_dots(spot, scalp, lip);
    let p = pigments(spot, lip, mucosa);
    var rgb = mix(colour_of(0u, p.x, p.y), colour_of(1u, p.x, p.y), lip);
    rgb *= mix(vec3f(1.0), VEIN_COLOUR, veins());
    let bristles = 0.6 + 0.4 * dotted[DOT_STUBBLE];
    let beard = 0.55 * paint.beard * saturate(zone[ZONE_BEARD]) * (1.0 - lip) * (0.45 + 0.9 * dotted[DOT_STUBBLE]);
    rgb = over(rgb, STUBBLE_COLOUR, paint.stubble * scalp * bristles);
    rgb = over(rgb, BEARD_COLOUR, beard);
    let wet = max(mucosa, 1.0 - smoothstep(0.2, 1.2, spot.fields.z));
    let away = f32(NEAREST - (owner >> ID_BITS)) / STEPS;
    let height = relief(spot, lip) * (1.0 - smoothstep(0.5 * MARGIN, MARGIN, away)); // runs out beside the charts
    let bare = (1.0 - lip) * (1.0 - mucosa);
    let pores = saturate(0.45 + zone[ZONE_PORES]) * bare;
    let furrows = max(1.0 + zone[ZONE_FURROWS], 0.2) * bare * (0.8 + 1.4 * paint.age * paint.age);
    keep(id.xy, rgb, gloss(lip, wet, max(scalp * paint.stubble, beard)), height, vec3f(pores, furrows, spot.density));
}
