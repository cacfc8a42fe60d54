// One axis of one Gaussian: spreads light along u, or along v as the surface has it, by a variance given in mm^2.

override AXIS: u32 = 0u; // 0 along u, 1 along v
override SHEARED: bool = true; // whether u and v may meet at other than right angles
override EDGE: u32 = 0u; // what lies beyond a chart's edge

override ROWS_PER_UNIT: f32; // rows of the kernel table per unit of variance
override WIDEST: f32; // variance of the table's last row [step^2]
override TRUNCATION: f32; // taps reach this many standard deviations

const REPEATED: u32 = 0u; // the edge repeats itself: nothing from beyond it bleeds in
const CLEARED: u32 = 1u; // whatever the texture holds, the clear colour where that is nothing
const SKIPPED: u32 = 2u; // whatever the texture holds, left out where that is nothing
const WIDE_TRUNCATION: f32 = 4.0; // beyond the table, where the sampled Gaussian needs no correction
const SMOOTH: f32 = 1.6; // widest step over the source's width: its ripple stays under 0.1 %
const PI: f32 = 3.14159265358979;

struct Spread {
    variance_mm2: f32, // to be added
    before_mm2: f32, // already in the source
    clear: vec3f, // the light that empty texels show
}

// The Gaussian's covariance in texels makes one blur along u and one along a leaning v [Geusebroek2003].
struct Axis {
    per_mm: f32, // texels per mm
    lean: f32, // texels of u for each one of v
}

struct Kernel {
    taps: i32, // on each side
    step: i32, // texels between them
    q: f32, // weight of the first tap over the centre's
}

@group(0) @binding(0) var<uniform> spread: Spread;
@group(0) @binding(1) var source: texture_2d<f32>; // light, and 1 where there is surface
@group(0) @binding(2) var stretch_map: texture_2d<f32>; // texels per mm along u, v; cosine between them; 1 in the apron
@group(0) @binding(3) var reach_map: texture_2d<u32>; // texels on the same chart: left, right, up, down
@group(0) @binding(4) var kernel_table: texture_2d<f32>; // row: variance, column: taps on each side
@group(0) @binding(5) var blurred: texture_storage_2d<rgba32float, write>;

fn along_v(stretch: vec4f) -> Axis {
    if (!SHEARED) {
        return Axis(stretch.y, 0.0);
    }
    return Axis(stretch.y * inverseSqrt(1.0 - stretch.z * stretch.z), -stretch.z * stretch.x / stretch.y);
}

// Texels between taps. Only a source that is already smooth at the step's scale may be read sparsely.
fn tap_step(sigma: f32, sigma_before: f32) -> f32 {
    return max(1.0, floor(min(SMOOTH * sigma_before, sigma)));
}

fn kernel_of(variance: f32, step: f32) -> Kernel {
    let taps = i32(ceil(select(TRUNCATION, WIDE_TRUNCATION, variance > WIDEST) * sqrt(variance)));
    return Kernel(taps, i32(step), first_ratio(taps, variance));
}

// Weight of the first tap over the centre's, such that the kernel of `taps` has the variance.
fn first_ratio(taps: i32, variance: f32) -> f32 {
    if (variance > WIDEST) {
        return exp(-0.5 / variance);
    }
    let row = variance * ROWS_PER_UNIT;
    let low = textureLoad(kernel_table, vec2i(taps, i32(row)), 0).x;
    let high = textureLoad(kernel_table, vec2i(taps, i32(row) + 1), 0).x;
    return mix(low, high, fract(row));
}

// Variance that reading between two texels of u will add on the way along v: the mean of f (1 - f) over the taps.
fn added_by_lean(stretch: vec4f) -> f32 {
    let v = along_v(stretch);
    let sigma = sqrt(spread.variance_mm2) * v.per_mm;
    let step = tap_step(sigma, sqrt(spread.before_mm2) * v.per_mm);
    let kernel = kernel_of(sigma * sigma / (step * step), step);
    var ratio = kernel.q;
    var weight = 1.0;
    var sum = 0.0;
    var total = 1.0;
    for (var n = 1; n <= kernel.taps; n++) {
        weight *= ratio;
        ratio *= kernel.q * kernel.q;
        let f = fract(v.lean * f32(n * kernel.step));
        sum += 2.0 * weight * f * (1.0 - f);
        total += 2.0 * weight;
    }
    return sum / total;
}

fn texel(at: vec2i) -> vec4f {
    if (EDGE == REPEATED && !SHEARED) {
        return textureLoad(source, at, 0);
    }
    let size = vec2i(textureDimensions(source));
    let light = textureLoad(source, clamp(at, vec2i(0), size - 1), 0);
    if (EDGE == CLEARED) {
        return vec4f(light.rgb + (1.0 - light.a) * spread.clear, 1.0);
    }
    return light;
}

// The light some texels from here along the axis; its fourth component is the share of it that is surface.
fn tap(here: vec2i, offset: i32, lean: f32) -> vec4f {
    if (AXIS == 0u) {
        return texel(here + vec2i(offset, 0));
    }
    if (!SHEARED || lean == 0.0) {
        return texel(here + vec2i(0, offset));
    }
    let drift = lean * f32(offset);
    let column = floor(drift);
    let at = here + vec2i(i32(column), offset);
    return mix(texel(at), texel(at + vec2i(1, 0)), drift - column);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let here = vec2i(id.xy);
    let stretch = textureLoad(stretch_map, here, 0);
    if (AXIS == 1u && stretch.w > 0.0) {
        return; // the apron is filled from where its light belongs
    }
    if (stretch.x == 0.0) {
        textureStore(blurred, here, vec4f(0.0)); // no surface here
        return;
    }
    var axis = Axis(stretch.x, 0.0);
    if (AXIS == 1u) {
        axis = along_v(stretch);
    }
    let sigma = sqrt(spread.variance_mm2) * axis.per_mm;
    let step = tap_step(sigma, sqrt(spread.before_mm2) * axis.per_mm);
    var variance = sigma * sigma;
    if (SHEARED && AXIS == 0u && stretch.z != 0.0) {
        variance = max(0.0, variance - added_by_lean(stretch));
    }
    let kernel = kernel_of(variance / (step * step), step);
    var limit = vec2i(1 << 20u);
    if (EDGE == REPEATED) {
        let reach = vec4i(textureLoad(reach_map, here, 0));
        limit = select(reach.zw, reach.xy, AXIS == 0u);
    }
    // Weights exp(-b n^2) by their ratios: q, q^3, q^5, ... with q = exp(-b).
    var ratio = kernel.q;
    var weight = 1.0;
    var sum = texel(here);
    for (var n = 1; n <= kernel.taps; n++) {
        weight *= ratio;
        ratio *= kernel.q * kernel.q;
        let offset = n * kernel.step;
        sum += weight * (tap(here, -min(offset, limit.x), axis.lean) + tap(here, min(offset, limit.y), axis.lean));
    }
    textureStore(blurred, here, sum / sum.a);
}
