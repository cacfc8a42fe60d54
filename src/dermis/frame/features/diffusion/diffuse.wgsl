// One axis of one Gaussian: blurs light along u, or along v as it leans on the surface, by a variance given in mm^2.
//#include "source.wgsl"
//#include "store.wgsl"
//#include "atlas/reach.wgsl"

override AXIS: u32 = 0u; // 0 along u, 1 along v
override SHEARED: bool = true; // whether u and v may meet at other than right angles
override EDGE: u32 = 0u; // what lies beyond a chart's edge

override ROWS_PER_UNIT: f32; // rows of the kernel table per unit of variance
override WIDEST: f32; // variance of the table's last row [step^2]

const REPEATED: u32 = 0u; // the edge is repeated: nothing bleeds in from beyond it
const CLEARED: u32 = 1u; // blurs read across the edge, and the clear colour from empty texels
const SKIPPED: u32 = 2u; // blurs read across the edge, and leave out empty texels
const WIDE_TRUNCATION: f32 = 4.0; // beyond the table, where the sampled Gaussian needs no correction
const SMOOTH: f32 = 1.6; // largest step over the source's standard deviation: ripple stays under 0.1 %

struct Spread {
    variance_mm2: f32, // to be added
    before_mm2: f32, // already in the source
    resampled: f32, // part of it that resampling to this resolution and back adds [texel^2]
    to_come: f32, // what interpolation at the end will add to the source [texel^2]
    owed: f32, // what resampling added to the level before [texel^2]
    paid_mm2: f32, // variance of that level, from which it was taken off; any rest is taken off now
    truncation: f32, // taps reach this many standard deviations
    clear: vec3f, // the light that empty texels show, as the levels have light
}

// One of the two blurs that make the Gaussian, in texels.
struct Axis {
    variance: f32, // to be added
    before: f32, // already in the source
    lean: f32, // texels along u for each one along v
}

struct Kernel {
    taps: i32, // on each side
    step: i32, // texels between them
    q: f32, // weight of the first tap over the centre's
}

@group(0) @binding(0) var<uniform> spread: Spread;
@group(0) @binding(1) var stretch_map: texture_2d<f32>; // texels per mm along u and v; cosine between them
@group(0) @binding(2) var reach_map: texture_2d<u32>; // as reach.wgsl reads it
@group(0) @binding(3) var kernel_table: texture_2d<f32>; // row: variance, column: taps on each side; here and in the next row

// Variance of resampling, which the blur need not add [texel^2]; upright: texel^2 in a mm^2. Where texels are large, it may
// exceed the variance of the blur itself, and the rest is taken off the next one.
fn taken_off(upright: f32) -> f32 {
    return spread.resampled + max(spread.owed - spread.paid_mm2 * upright, 0.0);
}

// Any covariance is that of a blur along u and one along a leaning v [Geusebroek2003]: the latter has the lower right
// element, and the former what remains of the upper left one.
fn along_v(stretch: vec4f) -> Axis {
    let upright = stretch.xy * stretch.xy / (1.0 - stretch.z * stretch.z);
    var variance = spread.variance_mm2 * upright.y;
    var lean = -stretch.z * stretch.x / stretch.y;
    if (spread.resampled + spread.owed > 0.0) {
        let covariance = lean * variance;
        variance = max(variance - taken_off(upright.y), 0.0);
        let most = sqrt(max(spread.variance_mm2 * upright.x - taken_off(upright.x), 0.0) * variance);
        lean = clamp(covariance, -most, most) / max(variance, 1e-12);
    }
    return Axis(variance, max(upright.y * spread.before_mm2 - spread.to_come, 0.0), lean);
}

fn along_u(stretch: vec4f, v: Axis) -> Axis {
    let square = stretch.x * stretch.x;
    let upright = square / (1.0 - stretch.z * stretch.z);
    let all = upright * spread.variance_mm2 - taken_off(upright);
    let rest = max(all - v.lean * v.lean * v.variance, 0.0);
    return Axis(rest, max(square * spread.before_mm2 - spread.to_come, 0.0), 0.0);
}

// Texels between taps. Only a source that is already smooth at the step's scale may be read sparsely.
fn tap_step(axis: Axis) -> f32 {
    return max(1.0, floor(sqrt(min(SMOOTH * SMOOTH * axis.before, axis.variance))));
}

fn kernel_of(variance: f32, step: f32) -> Kernel {
    let scaled = variance / (step * step);
    let taps = i32(ceil(select(spread.truncation, WIDE_TRUNCATION, scaled > WIDEST) * sqrt(scaled)));
    return Kernel(taps, i32(step), first_ratio(taps, scaled));
}

// Weight of the first tap over the centre's, such that the kernel of `taps` has the variance.
fn first_ratio(taps: i32, variance: f32) -> f32 {
    if (variance > WIDEST) {
        return exp(-0.5 / variance);
    }
    let row = variance * ROWS_PER_UNIT;
    let ratio = textureLoad(kernel_table, vec2i(taps, i32(row)), 0).xy;
    return mix(ratio.x, ratio.y, fract(row));
}

// Variance along u that interpolation will add in the pass along v: the mean of f (1 - f) over the taps.
fn added_by_lean(v: Axis) -> f32 {
    let kernel = kernel_of(v.variance, tap_step(v));
    var ratio = kernel.q;
    var weight = 1.0;
    var sum = 0.0;
    var total = 1.0;
    var n = 1;
    loop {
        weight *= ratio;
        ratio *= kernel.q * kernel.q;
        let f = fract(v.lean * f32(n * kernel.step));
        sum += 2.0 * weight * f * (1.0 - f);
        total += 2.0 * weight;
        n++;
        if (n > kernel.taps) {
            break;
        }
    }
    return sum / total;
}

fn shown(light: vec4f) -> vec4f {
    if (EDGE == CLEARED) {
        return vec4f(light.rgb + (1.0 - light.a) * spread.clear, 1.0);
    }
    return light;
}

fn texel(at: vec2i) -> vec4f {
    if (EDGE == REPEATED) {
        return textureLoad(source, at, 0);
    }
    return shown(textureLoad(source, clamp(at, vec2i(0), vec2i(textureDimensions(source)) - 1), 0));
}

// Light `offset` texels from here along the axis; its alpha is the share that is surface.
fn tap(here: vec2f, offset: f32, lean: f32) -> vec4f {
    if (AXIS == 1u && SHEARED) {
        return shown(source_between(here + offset * vec2f(lean, 1.0)));
    }
    return texel(vec2i(here + select(vec2f(offset, 0.0), vec2f(0.0, offset), AXIS == 1u)));
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let here = vec2i(id.xy);
    // All that is read here is asked for at once: what follows is short, and would wait for each by itself.
    let stretch = textureLoad(stretch_map, here, 0);
    let reach = textureLoad(reach_map, here, 0);
    var sum = texel(here);
    var limit = vec2f(1e6);
    if (EDGE == REPEATED) {
        limit = reach_along(reach, AXIS);
    }
    if (AXIS == 1u && is_gutter(reach)) {
        return; // the gutter is filled from where its light belongs
    }
    if (stretch.x == 0.0) {
        store(id.xy, vec4f(0.0)); // no surface here
        return;
    }
    let v = along_v(stretch);
    var axis = v;
    if (AXIS == 0u) {
        axis = along_u(stretch, v);
    }
    let step = tap_step(axis);
    if (SHEARED && AXIS == 0u && v.lean != 0.0) {
        axis.variance = max(0.0, axis.variance - added_by_lean(v));
    }
    let kernel = kernel_of(axis.variance, step);
    // Weights exp(-b n^2) by their ratios: q, q^3, q^5, ... with q = exp(-b).
    let growth = kernel.q * kernel.q;
    var ratio = kernel.q;
    var weight = 1.0;
    var offset = 0.0;
    var n = 0;
    loop { // with its test at the end, as in lighting.wgsl; without taps q is 0
        weight *= ratio;
        ratio *= growth;
        offset += step;
        let reached = min(vec2f(offset), limit);
        sum += weight * (tap(vec2f(here), -reached.x, axis.lean) + tap(vec2f(here), reached.y, axis.lean));
        n++;
        if (n >= kernel.taps) {
            break;
        }
    }
    store(id.xy, vec4f(sum.rgb / sum.a, 1.0));
}
