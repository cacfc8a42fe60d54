// Gaussian blur along one axis: u, or v with a shear that corrects for the angle between u and v on the surface. The variance
// is given in mm^2.
//#include "source.wgsl"
//#include "store.wgsl"
//#include "atlas/reach.wgsl"

override AXIS: u32 = 0u; // 0 along u, 1 along v
override SHEARED: bool = true; // whether u and v may be oblique to each other
override EDGE: u32 = 0u; // filter mode at the edges of charts: REPEATED, CLEARED or SKIPPED

override ROWS_PER_UNIT: f32; // rows of the kernel table per unit of variance
override MAX_TABLE_VARIANCE: f32; // variance of the table's last row [step^2]

const REPEATED: u32 = 0u; // the edge texel is repeated
const CLEARED: u32 = 1u; // texels of other charts are read, and the clear colour instead of empty texels
const SKIPPED: u32 = 2u; // texels of other charts are read, and empty texels are skipped
const WIDE_TRUNCATION: f32 = 4.0; // in standard deviations, for variances beyond the table, which need no correction
const MAX_STEP: f32 = 1.6; // largest ratio of the step to the standard deviation of the source: the ripple stays below 0.1 %

struct Spread {
    variance_mm2: f32, // added by this blur
    source_mm2: f32, // variance of the source
    resampling: f32, // part of variance_mm2 that resampling to this resolution and back adds [texel^2]
    pending: f32, // part of source_mm2 that interpolation of the final sum will add [texel^2]
    previous_resampling: f32, // variance that resampling added to the previous level [texel^2]
    previous_mm2: f32, // variance that the previous blur added; if resampling added more, the excess is subtracted now
    truncation: f32, // half-width of the kernel in standard deviations
    clear: vec3f, // light of empty texels, scaled as in the levels
}

// One of the two blurs of a Gaussian, in texels.
struct Axis {
    variance: f32, // added by the blur
    source: f32, // variance of the source
    shear: f32, // offset along u per texel along v
}

struct Kernel {
    taps: i32, // on each side
    step: i32, // texels between taps
    q: f32, // ratio of the weight of the first tap to that of the centre
}

@group(0) @binding(0) var<uniform> spread: Spread;
@group(0) @binding(1) var stretch_map: texture_2d<f32>; // texels per mm along u and v; cosine of the angle between them
@group(0) @binding(2) var reach_map: texture_2d<u32>; // see reach.wgsl
@group(0) @binding(3) var kernel_table: texture_2d<f32>; // q by variance (row) and taps on each side (column), and q of the next row

// Variance that resampling adds, so that the blur need not [texel^2]. Where texels are large, it may exceed the variance of
// the blur itself; the excess is subtracted from the next blur.
// density2: [texel^2/mm^2]
fn resampling_variance(density2: f32) -> f32 {
    return spread.resampling + max(spread.previous_resampling - spread.previous_mm2 * density2, 0.0);
}

// A blur along u and one along a sheared v can give any covariance matrix [Geusebroek2003]: the blur along v gives its lower
// right element, and the blur along u what the upper left element then lacks.
fn along_v(stretch: vec4f) -> Axis {
    let density2 = stretch.xy * stretch.xy / (1.0 - stretch.z * stretch.z);
    var variance = spread.variance_mm2 * density2.y;
    var shear = -stretch.z * stretch.x / stretch.y;
    if (spread.resampling + spread.previous_resampling > 0.0) {
        let covariance = shear * variance;
        variance = max(variance - resampling_variance(density2.y), 0.0);
        let most = sqrt(max(spread.variance_mm2 * density2.x - resampling_variance(density2.x), 0.0) * variance);
        shear = clamp(covariance, -most, most) / max(variance, 1e-12);
    }
    return Axis(variance, max(density2.y * spread.source_mm2 - spread.pending, 0.0), shear);
}

fn along_u(stretch: vec4f, v: Axis) -> Axis {
    let square = stretch.x * stretch.x;
    let density2 = square / (1.0 - stretch.z * stretch.z);
    let all = density2 * spread.variance_mm2 - resampling_variance(density2);
    let rest = max(all - v.shear * v.shear * v.variance, 0.0);
    return Axis(rest, max(square * spread.source_mm2 - spread.pending, 0.0), 0.0);
}

// Texels between taps: more than 1 only if the source is smooth at that scale.
fn tap_step(axis: Axis) -> f32 {
    return max(1.0, floor(sqrt(min(MAX_STEP * MAX_STEP * axis.source, axis.variance))));
}

fn kernel_of(variance: f32, step: f32) -> Kernel {
    let scaled = variance / (step * step);
    let taps = i32(ceil(select(spread.truncation, WIDE_TRUNCATION, scaled > MAX_TABLE_VARIANCE) * sqrt(scaled)));
    return Kernel(taps, i32(step), first_ratio(taps, scaled));
}

// Ratio of the weight of the first tap to that of the centre at which a kernel of `taps` taps has the given variance.
fn first_ratio(taps: i32, variance: f32) -> f32 {
    if (variance > MAX_TABLE_VARIANCE) {
        return exp(-0.5 / variance);
    }
    let row = variance * ROWS_PER_UNIT;
    let ratio = textureLoad(kernel_table, vec2i(taps, i32(row)), 0).xy;
    return mix(ratio.x, ratio.y, fract(row));
}

// Variance along u that interpolation adds in the pass along a sheared v: the mean of f (1 - f) over the taps.
fn shear_variance(v: Axis) -> f32 {
    let kernel = kernel_of(v.variance, tap_step(v));
    var ratio = kernel.q;
    var weight = 1.0;
    var sum = 0.0;
    var total = 1.0;
    var n = 1;
    loop {
        weight *= ratio;
        ratio *= kernel.q * kernel.q;
        let f = fract(v.shear * f32(n * kernel.step));
        sum += 2.0 * weight * f * (1.0 - f);
        total += 2.0 * weight;
        n++;
        if (n > kernel.taps) {
            break;
        }
    }
    return sum / total;
}

fn with_clear_colour(light: vec4f) -> vec4f {
    if (EDGE == CLEARED) {
        return vec4f(light.rgb + (1.0 - light.a) * spread.clear, 1.0);
    }
    return light;
}

fn texel(at: vec2i) -> vec4f {
    if (EDGE == REPEATED) {
        return textureLoad(source, at, 0);
    }
    return with_clear_colour(textureLoad(source, clamp(at, vec2i(0), vec2i(textureDimensions(source)) - 1), 0));
}

// Light `offset` texels from here along the axis; alpha is the fraction that is surface.
fn tap(here: vec2f, offset: f32, shear: f32) -> vec4f {
    if (AXIS == 1u && SHEARED) {
        return with_clear_colour(source_between(here + offset * vec2f(shear, 1.0)));
    }
    return texel(vec2i(here + select(vec2f(offset, 0.0), vec2f(0.0, offset), AXIS == 1u)));
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let here = vec2i(id.xy);
    // Loaded together, so that the loads overlap.
    let stretch = textureLoad(stretch_map, here, 0);
    let reach = textureLoad(reach_map, here, 0);
    var sum = texel(here);
    var limit = vec2f(1e6);
    if (EDGE == REPEATED) {
        limit = reach_along(reach, AXIS);
    }
    if (AXIS == 1u && is_gutter(reach)) {
        return; // gutters are filled by stitching
    }
    if (stretch.x == 0.0) {
        store(id.xy, vec4f(0.0)); // no surface
        return;
    }
    let v = along_v(stretch);
    var axis = v;
    if (AXIS == 0u) {
        axis = along_u(stretch, v);
    }
    let step = tap_step(axis);
    if (SHEARED && AXIS == 0u && v.shear != 0.0) {
        axis.variance = max(0.0, axis.variance - shear_variance(v));
    }
    let kernel = kernel_of(axis.variance, step);
    // Weights exp(-b n^2) by their ratios: q, q^3, q^5, ... with q = exp(-b).
    let growth = kernel.q * kernel.q;
    var ratio = kernel.q;
    var weight = 1.0;
    var offset = 0.0;
    var n = 0;
    loop { // with the test at the end, as in lighting.wgsl; without taps q is 0
        weight *= ratio;
        ratio *= growth;
        offset += step;
        let reached = min(vec2f(offset), limit);
        sum += weight * (tap(vec2f(here), -reached.x, axis.shear) + tap(vec2f(here), reached.y, axis.shear));
        n++;
        if (n >= kernel.taps) {
            break;
        }
    }
    store(id.xy, vec4f(sum.rgb / sum.a, 1.0));
}
