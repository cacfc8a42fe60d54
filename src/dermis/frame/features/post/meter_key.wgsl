// Exposure computed from the measurements: the root mean square of the metered light becomes the key value, but with less
// exposure if highlights would clip.

//#fill const METER_SIDE: u32 = {meter_side}u;
//#fill const KEY: f32 = {meter_key}; // value of white skin in the metered light
//#fill const CLIPPING: f32 = {meter_clipping}; // fraction of the points that may be brighter than 1
//#fill const MIN_HIGHLIGHT_FACTOR: f32 = {meter_stopped_down}; // least factor by which highlights lower the exposure
//#fill const FULL_SKIN_REFLECTANCE: f32 = {full_skin_reflectance};
//#fill const SKIN_COMPENSATION: f32 = {skin_compensation};
//#fill const MAX_SKIN_FACTOR: f32 = {max_skin_factor};
override FOR_SKIN: bool = false; // whether dark skin is exposed longer
const LANES: u32 = 256u;
const POINTS_PER_LANE: u32 = METER_SIDE * METER_SIDE / LANES; // metered points per invocation
const BISECTIONS: u32 = 24u; // of the range of radiances, down to 6e-5 of it
const MIN_EXPOSURE: f32 = 1e-6; // least exposure of the settings
const LOG_RANGE: vec2f = vec2f(-24.0, 24.0);

@group(0) @binding(0) var<storage, read> points: array<vec2f>; // see meter.wgsl
@group(0) @binding(1) var<storage, read_write> exposure: array<f32>;

var<workgroup> sums: array<vec3f, LANES>; // of squared light, number of points on skin, and sum of the radiances
var<workgroup> count_above: atomic<u32>;

fn root_mean_square(lane: u32) -> f32 {
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if (lane < step) {
            sums[lane] += sums[lane + step];
        }
    }
    workgroupBarrier();
    return sqrt(sums[0].x / max(sums[0].y, 1.0));
}

// Radiance that only the permitted number of points exceeds.
fn highlight_radiance(lane: u32, brightness: array<f32, POINTS_PER_LANE>) -> f32 {
    var log_radiance = brightness; // a copy, as it is indexed by a variable
    let max_count = u32(CLIPPING * sums[0].y);
    var low = LOG_RANGE.x;
    var high = LOG_RANGE.y;
    for (var k = 0u; k < BISECTIONS; k += 1u) {
        let middle = 0.5 * (low + high);
        if (lane == 0u) {
            atomicStore(&count_above, 0u);
        }
        workgroupBarrier();
        var count = 0u;
        for (var i = 0u; i < POINTS_PER_LANE; i += 1u) {
            count += u32(log_radiance[i] > middle);
        }
        if (count > 0u) {
            atomicAdd(&count_above, count);
        }
        workgroupBarrier();
        let brighter = atomicLoad(&count_above) > max_count;
        low = select(low, middle, brighter);
        high = select(middle, high, brighter);
        workgroupBarrier();
    }
    return exp2(high);
}

// reflectance : mean radiance of the skin relative to that of a white surface
fn skin_factor(reflectance: f32) -> f32 {
    return clamp(pow(FULL_SKIN_REFLECTANCE / max(reflectance, 1e-4), SKIN_COMPENSATION), 1.0, MAX_SKIN_FACTOR);
}

@compute @workgroup_size(LANES)
fn main(@builtin(local_invocation_index) lane: u32) {
    var brightness: array<f32, POINTS_PER_LANE>; // logarithms
    var sum = vec3f(0.0);
    for (var i = 0u; i < POINTS_PER_LANE; i += 1u) {
        let point = points[lane + i * LANES];
        let on_skin = point.x >= 0.0;
        sum += select(vec3f(0.0), vec3f(point.x * point.x, 1.0, point.y), on_skin);
        brightness[i] = select(LOG_RANGE.x, log2(max(point.y, 1e-7)), on_skin);
    }
    sums[lane] = sum;
    let light = root_mean_square(lane);
    let limit = 1.0 / highlight_radiance(lane, brightness);
    if (lane == 0u) {
        var key_exposure = KEY / light;
        if (FOR_SKIN) {
            key_exposure *= skin_factor(sums[0].z / (max(sums[0].y, 1.0) * light));
        }
        // Without light or skin the exposure is 1.
        let result = clamp(clamp(limit, MIN_HIGHLIGHT_FACTOR * key_exposure, key_exposure), MIN_EXPOSURE, 1.0 / MIN_EXPOSURE);
        exposure[0] = select(result, 1.0, light == 0.0);
    }
}
