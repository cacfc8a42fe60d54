// Grows the coarse strands of a groom: each strand is interpolated between four guides, drawn into its clump, curled and
// randomly varied. Strands that a person does not have, because of the hairline or a lower density, and knots below headwear
// get a negative radius.
//#include "each.wgsl"
//#include "strand_knots.wgsl"
//#include "skin_push.wgsl"

//#fill const KNOTS_PER_GUIDE: u32 = {knots_per_guide}; // of each guide
const MIN_HEIGHT_MM: f32 = 0.35; // least height of strands above the skin, away from their roots
const RISE_MM: f32 = 4.0; // length from the root along which this height is reached
const HAIRLINE_FADE_MM: vec2f = vec2f(-5.0, 7.0); // heights above the hairline between which density rises from 0 to 1
const SHORT_HAIRLINE_MM: vec2f = vec2f(-4.0, 14.0); // heights above it between which hair becomes longer and thicker
const SHORTEST: f32 = 0.55; // of the length of hair, and
const THINNEST: f32 = 0.35; // of its thickness, at the hairline
const HAIRLINE_NOISE_MM: f32 = 2.0; // standard deviation of the height of the hairline between strands
const BABY_DROP_MM: f32 = 4.0; // distance that baby hairs reach below other hair
const BABY_HAIRS_MM: vec2f = vec2f(4.0, 24.0); // heights above the hairline between which there are fewer baby hairs
const BABY_LENGTHS_MM: vec2f = vec2f(3.0, 17.0); // least and greatest length
const BABY_THICKNESS: f32 = 0.42;
const BABY_TURN: f32 = 0.35; // standard deviation of their direction, as a tangent
const LOOSE_HAIRLINE_MM: vec2f = vec2f(0.0, 22.0); // heights above the hairline between which hair clumps more
const LOOSEST: f32 = 0.25; // pull of clumps at the hairline, relative to that elsewhere
const TEMPLE_HEIGHTS_MM: vec2f = vec2f(90.0, -10.0); // between which there is more grey hair at temples,
const TEMPLE_ANGLES: vec2f = vec2f(140.0, 95.0); // and angles from the front between which there is [degrees]
const HAIRLINE_STEP: f32 = 2.0; // angle between heights of the hairline [degrees]
const HEAD_RADIUS_MM: f32 = 80.0;
const LIFTED_MM: f32 = 20.0; // height above the skin to which strands between guides are lifted onto the curved head
//#fill const HIDDEN_CEILING: f32 = {hidden_ceiling_mm}; // ceiling below which knots are hidden by headwear [mm]
const TIP_FRACTION: f32 = 0.12; // part of a strand along which it tapers
const TIP_WIDTH: f32 = 0.35;
const COLOURED_HAIRS: u32 = 5u; // hairs whose colours are averaged in a strand
const TURN: f32 = 6.2831853;

struct StrandRoot {
    corner: vec4u, // points of its quad, in order around it
    weight: vec4f, // of the points at the root
    guide: vec4u,
    guide_weight: vec4f,
    place: vec4f, // see the field `place` of StrandRoots
    clump: u32, // strand at the middle of its clump
    part: u32,
    along_mm: f32, // position of the clump along its row
    threshold: f32, // see the field `threshold` of StrandRoots
}

// Numbers of a part of a groom, such as scalp or beard; see groom.py.
struct GroomPart {
    density: f32,
    hairline: f32, // 1 if the hairline limits the hair
    thinning: f32, // of the crown, 0 to 1
    length_mm: f32,
    guide_mm: f32, // length of the guides
    fade: f32,
    layers: f32,
    clump: f32,
    clump_start_mm: f32, // distance from the root along which strands draw together
    rope_mm: f32,
    braid: f32,
    curl_mm: f32,
    pitch_mm: f32,
    incoherence: f32, // of the phases of curls in a clump
    frizz_mm: f32,
    flyaways: f32, // fraction of strands
    radius_mm: f32,
    cover: f32,
    grey: f32,
    hairs_per_strand: f32,
    clump_phases: f32, // randomness of the phases of curls between clumps
    baby_hairs: f32, // fraction of short strands at the hairline
    temple_grey: f32, // added to `grey` at the temples
    roots_mm: f32, // length of the undyed roots of dyed hair
    dark: vec3f, // absorption by the pigments of a hair [1/mm]
    seed: f32,
    white: vec3f, // least absorption
    dyed: f32, // 1 for dyed hair
    dye: vec3f, // absorption by the pigments of a dyed hair [1/mm]
    pad: f32,
}

@group(0) @binding(0) var<storage, read> points: array<f32>; // x, y, z [mm]
@group(0) @binding(1) var<storage, read> roots: array<StrandRoot>;
@group(0) @binding(2) var<storage, read> guides: array<vec4f>; // see guides_pose.wgsl
@group(0) @binding(3) var<storage, read> guide_cuts: array<f32>; // fraction of each guide up to the cut of the style
@group(0) @binding(4) var<storage, read> parts: array<GroomPart>;
@group(0) @binding(5) var<storage, read> hairline: array<f32>; // heights by angle [mm]
@group(0) @binding(6) var<storage, read_write> posed: array<vec4f>; // see strand_knots.wgsl

fn point_at(index: u32) -> vec3f {
    return vec3f(points[3u * index], points[3u * index + 1u], points[3u * index + 2u]);
}

// Uniform random number of a strand, 0 to 1. Source: PCG hash [Jarzynski2020].
fn random(strand: u32, stream: u32) -> f32 {
    let state = (strand * 64u + stream) * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
}

// Random number with a mean of 0 and a variance of 1, nearly normal.
fn random_normal(strand: u32, stream: u32) -> f32 {
    let sum = random(strand, stream) + random(strand, stream + 1u) + random(strand, stream + 2u);
    return 2.0 * (sum - 1.5);
}

struct Root {
    position: vec3f,
    along: vec3f,
    normal: vec3f,
}

fn root_of(strand: StrandRoot) -> Root {
    let a = point_at(strand.corner.x);
    let b = point_at(strand.corner.y);
    let c = point_at(strand.corner.z);
    let d = point_at(strand.corner.w);
    let along = normalize((b - a) + (c - d));
    let across = cross(c - a, d - b);
    return Root(mat4x3f(a, b, c, d) * strand.weight, along, normalize(across - dot(across, along) * along));
}

// Point of a curve that is interpolated between guides.
struct CurvePoint {
    position: vec3f,
    height: f32, // above the skin [mm]
    normal: vec3f, // of the skin below
    tangent: vec3f,
    ceiling: f32, // largest height, below headwear [mm]
}

// u: position along the guides, 0 to 1; root: position of the root, through which the curve passes
fn curve_at(strand: StrandRoot, u: f32, root: vec3f) -> CurvePoint {
    let at = clamp(u, 0.0, 1.0) * f32(KNOTS_PER_GUIDE - 1u);
    let first = min(u32(at), KNOTS_PER_GUIDE - 2u);
    let t = at - f32(first);
    let before = max(first, 1u) - 1u;
    let after = min(first + 2u, KNOTS_PER_GUIDE - 1u);
    // a Catmull-Rom spline through the knots, and its derivative
    let value = 0.5 * vec4f(t * (t * (2.0 - t) - 1.0), t * t * (3.0 * t - 5.0) + 2.0, t * (t * (4.0 - 3.0 * t) + 1.0), t * t * (t - 1.0));
    let slope = 0.5 * vec4f(t * (4.0 - 3.0 * t) - 1.0, t * (9.0 * t - 10.0), t * (8.0 - 9.0 * t) + 1.0, t * (3.0 * t - 2.0));
    var sum = CurvePoint(root, 0.0, vec3f(0.0), vec3f(0.0), 0.0);
    var middle = vec3f(0.0);
    var square = 0.0;
    for (var k = 0u; k < 4u; k += 1u) {
        let weight = strand.guide_weight[k];
        let begin = 2u * strand.guide[k] * KNOTS_PER_GUIDE;
        let row = begin + 2u * first;
        let knots = mat4x4f(guides[begin + 2u * before], guides[row], guides[row + 2u], guides[begin + 2u * after]);
        let here = knots * value;
        sum.position += weight * (here.xyz - guides[begin].xyz);
        sum.height += weight * here.w;
        let from_root = here.xyz - root;
        middle += weight * from_root;
        square += weight * dot(from_root, from_root);
        let outward = mix(guides[row + 1u], guides[row + 3u], t);
        sum.normal += weight * outward.xyz;
        sum.ceiling += weight * outward.w;
        sum.tangent += weight * (knots * slope).xyz;
    }
    sum.normal = normalize(sum.normal);
    sum.tangent = normalize(sum.tangent + 1e-9 * sum.normal);
    // a mean of points around a head lies below its surface
    let near = 1.0 / (1.0 + pow(max(sum.height, 0.0) / LIFTED_MM, 2.0));
    sum.position += near * max(square - dot(middle, middle), 0.0) / (2.0 * HEAD_RADIUS_MM) * sum.normal;
    return sum;
}

// Height of a root above the hairline of the person [mm].
fn above_hairline(place: vec4f) -> f32 {
    let at = place.x / HAIRLINE_STEP;
    let first = min(u32(at), arrayLength(&hairline) - 2u);
    return place.y - mix(hairline[first], hairline[first + 1u], at - f32(first));
}

// How a strand differs from others because it grows near the hairline.
struct Hairline {
    above: f32, // height of the root above the hairline, with a random part [mm]
    baby: f32, // 1 for a baby hair, else 0
}

fn hairline_of(index: u32, strand: StrandRoot, part: GroomPart) -> Hairline {
    let above = above_hairline(strand.place) + HAIRLINE_NOISE_MM * random_normal(index, 30u);
    let chance = part.hairline * part.baby_hairs * (1.0 - smoothstep(BABY_HAIRS_MM.x, BABY_HAIRS_MM.y, above));
    return Hairline(above, f32(random(index, 33u) < chance));
}

fn grows(seed: u32, strand: StrandRoot, part: GroomPart, edge: Hairline) -> bool {
    let fade = smoothstep(HAIRLINE_FADE_MM.x, HAIRLINE_FADE_MM.y, edge.above + BABY_DROP_MM * edge.baby);
    let density = mix(1.0, fade, part.hairline) * part.density * (1.0 - part.thinning * strand.place.z);
    return fract(strand.threshold + random(seed, 0u)) < density;
}

// Length of a strand, as a fraction of its guides.
fn length_of(index: u32, strand: StrandRoot, part: GroomPart, edge: Hairline) -> f32 {
    var cut = 0.0;
    for (var k = 0u; k < 4u; k += 1u) {
        cut += strand.guide_weight[k] * guide_cuts[strand.guide[k]];
    }
    let sides = 1.0 - part.fade * (1.0 - strand.place.w);
    let whole = mix(1.0, mix(SHORTEST, 1.0, smoothstep(SHORT_HAIRLINE_MM.x, SHORT_HAIRLINE_MM.y, edge.above)), part.hairline);
    let length = min(cut, part.length_mm / part.guide_mm * sides) * whole;
    let short = min(length, mix(BABY_LENGTHS_MM.x, BABY_LENGTHS_MM.y, random(index, 34u)) / part.guide_mm);
    return mix(length, short, edge.baby) * (1.0 - part.layers * random(index, 1u));
}

// Thickness of a strand, relative to strands far from the hairline.
fn thickness_of(part: GroomPart, edge: Hairline) -> f32 {
    let thinned = mix(THINNEST, 1.0, smoothstep(SHORT_HAIRLINE_MM.x, SHORT_HAIRLINE_MM.y, edge.above));
    return mix(1.0, min(thinned, mix(1.0, BABY_THICKNESS, edge.baby)), part.hairline);
}

// Unit vectors across a curve.
fn axes_across(at: CurvePoint) -> mat2x3f {
    var side = cross(at.tangent, at.normal);
    if (dot(side, side) < 0.08) {
        side = cross(at.tangent, vec3f(0.31, 0.2, 0.93));
    }
    side = normalize(side);
    return mat2x3f(side, cross(side, at.tangent));
}

// Offset of a strand within a rope of hair: one of three braided bundles, or a twist.
fn rope_offset(index: u32, part: GroomPart, s: f32, across: mat2x3f) -> vec3f {
    let radius = part.rope_mm * sqrt(random(index, 4u));
    let turn = TURN * random(index, 5u);
    if (part.braid > 0.0) {
        let phase = TURN * (s / (8.0 * part.rope_mm) + floor(3.0 * random(index, 6u)) / 3.0);
        let middle = part.rope_mm * vec2f(sin(phase), 0.45 * sin(2.0 * phase));
        return across * (middle + 0.5 * radius * vec2f(cos(turn), sin(turn)));
    }
    let phase = turn + TURN * s / (7.0 * part.rope_mm);
    return across * (radius * vec2f(cos(phase), sin(phase)));
}

// Phase of the curls of a clump [turns]: partly random, partly so that waves run across neighbouring clumps.
fn clump_phase(clump: u32, place: vec4f, part: GroomPart) -> f32 {
    let wave = 0.2 * sin(0.07 * place.x) - 0.5 * place.y / part.pitch_mm;
    return mix(wave, random(clump, 9u), part.clump_phases);
}

fn curl_offset(index: u32, clump: u32, place: vec4f, part: GroomPart, s: f32, across: mat2x3f) -> vec3f {
    let own = TURN * part.incoherence * random(index, 7u);
    let pitch = part.pitch_mm * (1.0 + 0.3 * part.clump_phases * (random(clump, 8u) - 0.5));
    let phase = TURN * (s / pitch + clump_phase(clump, place, part)) + own;
    let radius = part.curl_mm * (0.75 + 0.5 * random(index, 10u)) * min(s / (0.5 * part.pitch_mm + 4.0), 1.0);
    return across * (radius * vec2f(cos(phase), sin(phase)));
}

// Smooth random displacement, 0 at the root; larger for hairs that fly away.
fn frizz_offset(index: u32, part: GroomPart, s: f32, across: mat2x3f) -> vec3f {
    let flies = random(index, 11u) < part.flyaways;
    let amount = part.frizz_mm * select(1.0, 5.0, flies) * min(s / 25.0, 1.0);
    let phases = TURN * vec2f(random(index, 12u), random(index, 13u));
    let slow = TURN * s / 90.0;
    let fast = TURN * s / 31.0;
    let waves = vec2f(sin(slow + phases.x) + 0.4 * sin(fast + phases.y), cos(slow + phases.y) + 0.4 * cos(fast + phases.x));
    return across * (amount * vec2f(random_normal(index, 14u), random_normal(index, 17u)) * waves);
}

fn absorption_of(index: u32, place: vec4f, part: GroomPart) -> vec3f {
    let temple = smoothstep(TEMPLE_HEIGHTS_MM.x, TEMPLE_HEIGHTS_MM.y, place.y) * smoothstep(TEMPLE_ANGLES.x, TEMPLE_ANGLES.y, place.x);
    let greyed = part.grey + part.temple_grey * part.hairline * temple;
    var grey_hairs = 0.0;
    for (var k = 0u; k < COLOURED_HAIRS; k += 1u) {
        grey_hairs += f32(random(index, 20u + k) < greyed);
    }
    let white = grey_hairs / f32(COLOURED_HAIRS);
    let dark = part.dark * exp(0.12 * random_normal(index, 26u));
    let grey = vec3f((dark.x + dark.y + dark.z) / 3.0);
    let mixed = (1.0 - white) * (1.0 - white) * mix(dark, grey, white);
    return max(mixed, part.white) / (part.hairs_per_strand * hairs.width_scale);
}

// Position of a knot, and 1, or -1 if headwear hides it.
fn strand_position(index: u32, seed: u32, strand: StrandRoot, part: GroomPart, edge: Hairline, root: Root, u: f32) -> vec4f {
    let s = u * part.guide_mm;
    let own = curve_at(strand, u, root.position);
    let middle = roots[strand.clump];
    let at = curve_at(middle, u, root_of(middle).position);
    let near = 1.0 - exp(-pow(s / part.clump_start_mm, 1.5));
    let is_rope = f32(part.rope_mm > 0.0);
    let loose = mix(1.0, mix(LOOSEST, 1.0, smoothstep(LOOSE_HAIRLINE_MM.x, LOOSE_HAIRLINE_MM.y, edge.above)), part.hairline);
    let pull = part.clump * near * (1.0 - edge.baby) * mix((0.6 + 0.4 * random(index, 2u)) * loose, 1.0, is_rope);
    let across = axes_across(at);
    var offset = pull * (at.position - own.position);
    if (part.rope_mm > 0.0) {
        offset += (1.0 - edge.baby) * near * rope_offset(index, part, s + strand.along_mm, across);
    }
    if (part.curl_mm > 0.0 && part.rope_mm == 0.0) {
        offset += curl_offset(index, strand.clump + seed, middle.place, part, s, across);
    }
    offset += frizz_offset(index, part, s, across) + edge.baby * BABY_TURN * s * random_normal(index, 35u) * across[0];
    let height = mix(own.height, at.height, pull) + dot(offset - pull * (at.position - own.position), own.normal);
    let least = MIN_HEIGHT_MM * min(s / RISE_MM, 1.0);
    let lift = max(least - height, 0.0) + min(max(own.ceiling, least) - height, 0.0);
    let lifted = own.position + offset + lift * own.normal;
    let shown = select(1.0, -1.0, own.ceiling < HIDDEN_CEILING);
    if (s == 0.0) {
        return vec4f(lifted, shown);
    }
    return vec4f(outside_skin(lifted, least, s), shown);
}

// Cover and the fraction of a strand from which it is dyed, packed for strands_light.wgsl; 0 for a strand that is not dyed.
fn packed_cover(part: GroomPart, length_mm: f32) -> f32 {
    let begin = clamp(part.roots_mm / max(length_mm, 1e-3), 0.002, 0.998);
    return floor(COVER_STEPS * part.cover) + part.dyed * begin;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let knot = list_index(group, groups, lane);
    let index = knot / hairs.coarse_knots;
    if (index >= hairs.coarse) {
        return;
    }
    let hair = hairs.fine + index;
    let k = knot % hairs.coarse_knots;
    let strand = roots[index];
    let part = parts[strand.part];
    let root = root_of(strand);
    let seed = u32(part.seed) * 131071u;
    let random_index = index + seed;
    let edge = hairline_of(random_index, strand, part);
    let length = length_of(random_index, strand, part, edge);
    var at = vec4f(root.position, -1.0);
    if (grows(seed, strand, part, edge)) {
        let along = f32(k) / f32(hairs.coarse_knots - 1u);
        let taper = mix(1.0, TIP_WIDTH, smoothstep(1.0 - TIP_FRACTION, 1.0, along));
        let radius = part.radius_mm * (0.8 + 0.4 * random(random_index, 3u)) * taper * thickness_of(part, edge);
        let position = strand_position(random_index, seed, strand, part, edge, root, along * length);
        at = vec4f(position.xyz, position.w * hairs.width_scale * radius);
    }
    posed[row_of_knot(hairs.fine * hairs.fine_knots + knot, hair)] = at;
    if (k == 0u) {
        let row = row_of_hair(hair);
        posed[row] = vec4f(root.normal, hairs.width_scale * part.radius_mm);
        posed[row + 1u] = vec4f(absorption_of(random_index, strand.place, part), packed_cover(part, length * part.guide_mm));
    }
}
