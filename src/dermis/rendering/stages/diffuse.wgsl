// One axis of one Gaussian: spreads light along u or v of the atlas by a variance given in mm^2.

override AXIS: u32 = 0u; // 0 along u, 1 along v

override ROWS_PER_UNIT: f32; // rows of the kernel table per unit of variance
override WIDEST: f32; // variance of the table's last row [step^2]
override TRUNCATION: f32; // taps reach this many standard deviations

const WIDE_TRUNCATION: f32 = 4.0; // beyond the table, where the sampled Gaussian needs no correction
const SMOOTH: f32 = 1.6; // widest step over the source's width: its ripple stays under 0.1 %

struct Spread {
    variance_mm2: f32, // to be added
    before_mm2: f32, // already in the source
}

@group(0) @binding(0) var<uniform> spread: Spread;
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var stretch_map: texture_2d<f32>; // texels per mm along u, v
@group(0) @binding(3) var reach_map: texture_2d<u32>; // texels on the same chart: left, right, up, down
@group(0) @binding(4) var kernel_table: texture_2d<f32>; // row: variance, column: taps on each side
@group(0) @binding(5) var blurred: texture_storage_2d<rgba32float, write>;

// Texels between taps. Only a source that is already smooth at the step's scale may be read sparsely.
fn tap_step(sigma: f32, sigma_before: f32) -> f32 {
    return max(1.0, floor(min(SMOOTH * sigma_before, sigma)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let here = vec2i(id.xy);
    let reach = vec4i(textureLoad(reach_map, here, 0));
    let texels_per_mm = textureLoad(stretch_map, here, 0)[AXIS];
    if (texels_per_mm == 0.0) {
        textureStore(blurred, here, vec4f(0.0)); // no surface here
        return;
    }
    let centre = textureLoad(source, here, 0);
    let sigma = sqrt(spread.variance_mm2) * texels_per_mm;
    let step = tap_step(sigma, sqrt(spread.before_mm2) * texels_per_mm);
    let variance = sigma * sigma / (step * step);
    let taps = i32(ceil(select(TRUNCATION, WIDE_TRUNCATION, variance > WIDEST) * sqrt(variance)));
    let axis = select(vec2i(0, 1), vec2i(1, 0), AXIS == 0u);
    let behind = select(reach.z, reach.x, AXIS == 0u);
    let ahead = select(reach.w, reach.y, AXIS == 0u);
    // Weights exp(-b n^2) by their ratios: q, q^3, q^5, ... with q = exp(-b).
    let q = first_ratio(taps, variance);
    var ratio = q;
    var weight = 1.0;
    var sum = centre;
    var total = 1.0;
    for (var n = 1; n <= taps; n++) {
        weight *= ratio;
        ratio *= q * q;
        let offset = n * i32(step);
        // The chart's edge repeats itself: nothing from beyond it bleeds in.
        let one = textureLoad(source, here - axis * min(offset, behind), 0);
        let other = textureLoad(source, here + axis * min(offset, ahead), 0);
        sum += weight * (one + other);
        total += 2.0 * weight;
    }
    textureStore(blurred, here, sum / total);
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
