// Fragments of strands in a pixel: the nearest fragments are kept and composited over the picture.
//#include "shape/geometry.wgsl"
//#include "strand_view.wgsl"
//#include "strand_tiles.wgsl"

const MAX_FRAGMENTS: u32 = 8u; // fragments that a pixel keeps; those behind are blended by their mean radiance and total cover
const MAX_DEPTH_SAMPLES: u32 = 8u; // samples of a pixel whose depth strands are compared with
const FAR: f32 = 2e30; // depth of an empty fragment, behind everything [mm]
const FIXED_POINT: f32 = 16384.0; // scale of integer sums, which do not depend on the order
const MAX_RADIANCE: f32 = 16.0; // largest radiance of fragments behind those kept

@group(0) @binding(30) var<storage, read> projected: array<ProjectedKnot>;
@group(0) @binding(33) var visibility_buffer: texture_2d_array<u32>; // triangle + 1 of each sample

// A segment of a strand over a pixel.
struct Fragment {
    depth: f32, // [mm]
    begin: u32, // first knot of the segment
    along: f32, // position along the segment, 0 to 1
    cover: f32, // fraction of the pixel
}

// Depths of the surface at up to eight samples of a pixel.
struct Depths {
    first: vec4f,
    second: vec4f,
    weight: f32, // fraction of the pixel that a sample represents
}

fn depth_at(triangle: u32, position: vec2f) -> f32 {
    let t = triangle_at(triangle);
    let a = position_of(t.x);
    let n = cross(position_of(t.y) - a, position_of(t.z) - a);
    let ndc = vec2f(2.0, -2.0) * position / strand_view.size + vec2f(-1.0, 1.0);
    let ray = strand_view.forward + (ndc.x + strand_view.shift.x) * strand_view.right + (ndc.y + strand_view.shift.y) * strand_view.up;
    return dot(n, a - strand_view.eye) / dot(n, ray);
}

// Samples of a pixel. The bound by the number of layers keeps Mesa's software driver from inlining the record's value into the
// shader, which it would then compile again at each dispatch.
fn sample_count() -> u32 {
    return min(strand_view.samples, textureNumLayers(visibility_buffer));
}

fn depths_at(pixel: vec2u) -> Depths {
    let samples = sample_count();
    let count = min(samples, MAX_DEPTH_SAMPLES);
    var depths = Depths(vec4f(-1.0), vec4f(-1.0), 1.0 / f32(count));
    for (var k = 0u; k < count; k += 1u) {
        let s = k * samples / count;
        let triangle = textureLoad(visibility_buffer, pixel, s, 0).x;
        var depth = 1e30;
        if (triangle > 0u) {
            depth = depth_at(triangle - 1u, vec2f(pixel) + strand_view.jitter[s].xy);
        }
        if (k < 4u) {
            depths.first[k] = depth;
        } else {
            depths.second[k - 4u] = depth;
        }
    }
    return depths;
}

// Fraction of the samples of a pixel at which the surface is farther than a depth.
fn visible_fraction(depth: f32, depths: Depths) -> f32 {
    let first = select(vec4f(0.0), vec4f(1.0), vec4f(depth) < depths.first);
    let second = select(vec4f(0.0), vec4f(1.0), vec4f(depth) < depths.second);
    return depths.weight * dot(first + second, vec4f(1.0));
}

// A segment of a strand in the picture, and the bisectors at which it ends, between it and its neighbours.
struct Segment {
    a: vec2f,
    b: vec2f,
    direction: vec2f, // unit
    extent: f32, // length [pixel]
    first: vec2f, // normal of the bisector at a
    last: vec2f, // normal of the bisector at b
    ends: vec4f, // widths of a and b, then depths
    begin: u32, // first knot
}

fn unit(v: vec2f) -> vec2f {
    return v / max(length(v), 1e-6);
}

fn load_segment(packed: u32) -> Segment {
    let begin = first_knot_of(packed);
    let a = projected[begin];
    let b = projected[begin + 1u];
    let extent = distance(a.position, b.position);
    let direction = (b.position - a.position) / max(extent, 1e-4);
    var first = direction;
    var last = direction;
    if ((packed & FIRST_SEGMENT) == 0u) {
        first += unit(a.position - projected[begin - 1u].position);
    }
    if ((packed & LAST_SEGMENT) == 0u) {
        last += unit(projected[begin + 2u].position - b.position);
    }
    return Segment(a.position, b.position, direction, extent, first, last, vec4f(a.width, b.width, a.depth, b.depth), begin);
}

// Fragment of a segment; strands narrower than a pixel are drawn a pixel wide with less cover.
fn fragment_of(position: vec2f, one: Segment) -> Fragment {
    let none = Fragment(0.0, 0u, 0.0, 0.0);
    if (one.extent < 1e-4) {
        return none;
    }
    let from_a = position - one.a;
    let forward = dot(from_a, one.direction);
    let along = clamp(forward / one.extent, 0.0, 1.0);
    let lateral = abs(from_a.x * one.direction.y - from_a.y * one.direction.x);
    let width = mix(one.ends.x, one.ends.y, along);
    let drawn_width = max(width, 1.0);
    let beyond = max(-forward, forward - one.extent); // beyond an end, where strands bend sharply
    if (lateral >= 0.5 * drawn_width + 0.5 || beyond > 0.5 * drawn_width + 0.5 || dot(from_a, one.first) < 0.0 || dot(position - one.b, one.last) >= 0.0) {
        return none;
    }
    let cover = clamp(0.5 * drawn_width + 0.5 - lateral, 0.0, 1.0) * width / drawn_width;
    return Fragment(mix(one.ends.z, one.ends.w, along), one.begin, along, cover);
}

fn in_front(a: Fragment, b: Fragment) -> bool {
    return a.depth < b.depth || (a.depth == b.depth && a.begin < b.begin);
}

fn radiance_at(one: Fragment) -> vec3f {
    return mix(projected[one.begin].radiance, projected[one.begin + 1u].radiance, one.along);
}

// State of the pixel.
var<private> nearest: array<Fragment, MAX_FRAGMENTS>;
var<private> cover_sums: vec2u; // of all fragments: cover, and negative logarithm of the transmittance
var<private> light: vec3u; // radiance times cover of all fragments

fn clear_fragments() {
    for (var k = 0u; k < MAX_FRAGMENTS; k += 1u) {
        nearest[k] = Fragment(FAR, 0u, 0.0, 0.0);
    }
    cover_sums = vec2u(0u);
    light = vec3u(0u);
}

// Replaces a kept fragment by one in front of it; returns the fragment that is farther.
fn insert(k: u32, one: Fragment) -> Fragment {
    let other = nearest[k];
    if (in_front(one, other)) {
        nearest[k] = one;
        return other;
    }
    return one;
}

fn add_fragment(fragment: Fragment) {
    var one = fragment;
    if (in_front(one, nearest[MAX_FRAGMENTS - 1u])) {
        one = insert(0u, one); // unrolled, see `rows_per_invocation`
        one = insert(1u, one);
        one = insert(2u, one);
        one = insert(3u, one);
        one = insert(4u, one);
        one = insert(5u, one);
        one = insert(6u, one);
        one = insert(7u, one);
    }
    cover_sums += vec2u(FIXED_POINT * vec2f(one.cover, -log(max(1.0 - one.cover, 1e-4))));
    light += vec3u(FIXED_POINT * one.cover * min(radiance_at(one), vec3f(MAX_RADIANCE)));
}

// Strands over the radiance behind them, from front to back.
fn composite(background: vec4f) -> vec4f {
    var transmittance = 1.0;
    var sum = vec3f(0.0);
    for (var k = 0u; k < MAX_FRAGMENTS; k += 1u) {
        sum += transmittance * nearest[k].cover * radiance_at(nearest[k]);
        transmittance *= 1.0 - nearest[k].cover;
    }
    let behind = exp(-f32(cover_sums.y) / FIXED_POINT);
    sum += transmittance * (1.0 - behind) * vec3f(light) / f32(max(cover_sums.x, 1u));
    transmittance *= behind;
    return vec4f(sum + transmittance * background.rgb, 1.0 - transmittance * (1.0 - background.a));
}
