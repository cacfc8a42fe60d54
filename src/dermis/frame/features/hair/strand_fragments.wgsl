// Pieces of hair over a pixel: which cover it, the nearest of them, and these over what it shows.
//#include "shape/geometry.wgsl"
//#include "strand_view.wgsl"
//#include "strand_tiles.wgsl"

const NEAREST: u32 = 8u; // pieces that a pixel keeps; those behind them count by their mean and what they cover
const MOST_DEPTHS: u32 = 8u; // samples of a pixel that hairs are compared with
const FAR: f32 = 2e30; // depth of no piece, behind everything [mm]
const FIXED: f32 = 16384.0; // so that sums do not depend on the order
const BRIGHTEST: f32 = 16.0; // radiance of pieces behind those kept

@group(0) @binding(30) var<storage, read> drawn: array<Drawn>;
@group(0) @binding(33) var visibility_buffer: texture_2d_array<u32>; // triangle + 1 of each sample

// A piece of hair over a pixel.
struct Fragment {
    depth: f32, // [mm]
    begin: u32, // knot of the piece
    along: f32, // of the piece, 0 to 1
    cover: f32, // of the pixel
}

// Depths of the surface at the samples of a pixel, up to eight.
struct Depths {
    first: vec4f,
    second: vec4f,
    share: f32, // of the pixel that a sample stands for
}

fn depth_at(triangle: u32, place: vec2f) -> f32 {
    let t = triangle_at(triangle);
    let a = position_of(t.x);
    let n = cross(position_of(t.y) - a, position_of(t.z) - a);
    let ndc = vec2f(2.0, -2.0) * place / strand_view.size + vec2f(-1.0, 1.0);
    let ray = strand_view.forward + (ndc.x + strand_view.shift.x) * strand_view.right + (ndc.y + strand_view.shift.y) * strand_view.up;
    return dot(n, a - strand_view.eye) / dot(n, ray);
}

// Samples of a pixel. There are no more than layers: that keeps Mesa's software driver from putting the record's number into
// the shader, which it would then compile anew, and keep, at each dispatch.
fn sample_count() -> u32 {
    return min(strand_view.samples, textureNumLayers(visibility_buffer));
}

fn depths_at(pixel: vec2u) -> Depths {
    let samples = sample_count();
    let count = min(samples, MOST_DEPTHS);
    var depths = Depths(vec4f(-1.0), vec4f(-1.0), 1.0 / f32(count));
    for (var k = 0u; k < count; k += 1u) {
        let s = k * samples / count;
        let found = textureLoad(visibility_buffer, pixel, s, 0).x;
        var depth = 1e30;
        if (found > 0u) {
            depth = depth_at(found - 1u, vec2f(pixel) + strand_view.jitter[s].xy);
        }
        if (k < 4u) {
            depths.first[k] = depth;
        } else {
            depths.second[k - 4u] = depth;
        }
    }
    return depths;
}

// Share of a pixel at whose samples the surface is farther away.
fn free_share(depth: f32, depths: Depths) -> f32 {
    let first = select(vec4f(0.0), vec4f(1.0), vec4f(depth) < depths.first);
    let second = select(vec4f(0.0), vec4f(1.0), vec4f(depth) < depths.second);
    return depths.share * dot(first + second, vec4f(1.0));
}

// A piece of hair, and the lines on which it meets those beside it: they halve its angles with these.
struct Held {
    a: vec2f,
    b: vec2f,
    way: vec2f, // unit
    run: f32, // [pixel]
    first: vec2f,
    last: vec2f,
    ends: vec4f, // widths, then depths
    begin: u32, // its first knot
}

fn unit(way: vec2f) -> vec2f {
    return way / max(length(way), 1e-6);
}

fn hold(listed: u32) -> Held {
    let begin = begin_of(listed);
    let a = drawn[begin];
    let b = drawn[begin + 1u];
    let run = distance(a.place, b.place);
    let way = (b.place - a.place) / max(run, 1e-4);
    var first = way;
    var last = way;
    if ((listed & FIRST_PIECE) == 0u) {
        first += unit(a.place - drawn[begin - 1u].place);
    }
    if ((listed & LAST_PIECE) == 0u) {
        last += unit(drawn[begin + 2u].place - b.place);
    }
    return Held(a.place, b.place, way, run, first, last, vec4f(a.width, b.width, a.depth, b.depth), begin);
}

// A hair narrower than a pixel is drawn a pixel wide and covers less of it.
fn fragment_of(place: vec2f, one: Held) -> Fragment {
    let none = Fragment(0.0, 0u, 0.0, 0.0);
    if (one.run < 1e-4) {
        return none;
    }
    let from_a = place - one.a;
    let along = clamp(dot(from_a, one.way) / one.run, 0.0, 1.0);
    let beside = abs(from_a.x * one.way.y - from_a.y * one.way.x);
    let width = mix(one.ends.x, one.ends.y, along);
    let shown = max(width, 1.0);
    if (beside >= 0.5 * shown + 0.5 || dot(from_a, one.first) < 0.0 || dot(place - one.b, one.last) >= 0.0) {
        return none;
    }
    let cover = clamp(0.5 * shown + 0.5 - beside, 0.0, 1.0) * width / shown;
    return Fragment(mix(one.ends.z, one.ends.w, along), one.begin, along, cover);
}

fn in_front(a: Fragment, b: Fragment) -> bool {
    return a.depth < b.depth || (a.depth == b.depth && a.begin < b.begin);
}

fn radiance_at(one: Fragment) -> vec3f {
    return mix(drawn[one.begin].radiance, drawn[one.begin + 1u].radiance, one.along);
}

// What a pixel shows of hairs.
var<private> kept: array<Fragment, NEAREST>;
var<private> farther: vec2u; // cover of pieces behind those kept, and the logarithm of what they let through
var<private> light: vec3u; // of these

fn take_none() {
    for (var k = 0u; k < NEAREST; k += 1u) {
        kept[k] = Fragment(FAR, 0u, 0.0, 0.0);
    }
    farther = vec2u(0u);
    light = vec3u(0u);
}

// Puts a fragment in the place of one behind it, which is handed on.
fn settle(k: u32, one: Fragment) -> Fragment {
    let other = kept[k];
    if (in_front(one, other)) {
        kept[k] = one;
        return other;
    }
    return one;
}

fn take(fragment: Fragment) {
    var one = fragment;
    if (in_front(one, kept[NEAREST - 1u])) {
        one = settle(0u, one); // without a loop, see `rows_of`
        one = settle(1u, one);
        one = settle(2u, one);
        one = settle(3u, one);
        one = settle(4u, one);
        one = settle(5u, one);
        one = settle(6u, one);
        one = settle(7u, one);
    }
    farther += vec2u(FIXED * vec2f(one.cover, -log(max(1.0 - one.cover, 1e-4))));
    light += vec3u(FIXED * one.cover * min(radiance_at(one), vec3f(BRIGHTEST)));
}

// Hairs over what a pixel shows, the nearest first.
fn laid_over(under: vec4f) -> vec4f {
    var through = 1.0;
    var sum = vec3f(0.0);
    for (var k = 0u; k < NEAREST; k += 1u) {
        sum += through * kept[k].cover * radiance_at(kept[k]);
        through *= 1.0 - kept[k].cover;
    }
    let rest = exp(-f32(farther.y) / FIXED);
    sum += through * (1.0 - rest) * vec3f(light) / f32(max(farther.x, 1u));
    through *= rest;
    return vec4f(sum + through * under.rgb, 1.0 - through * (1.0 - under.a));
}
