// The exposure that the meter's points ask for: the root mean square of their light becomes the key, unless highlights clip.

//#fill const METER_SIDE: u32 = {meter_side}u;
//#fill const KEY: f32 = {meter_key}; // what white skin shows in that light
//#fill const CLIPPING: f32 = {meter_clipping}; // share of the points that may be brighter than 1
//#fill const STOPPED_DOWN: f32 = {meter_stopped_down}; // least factor by which highlights lower the exposure
const LANES: u32 = 256u;
const OF_LANE: u32 = METER_SIDE * METER_SIDE / LANES; // points
const HALVINGS: u32 = 24u; // of the range of radiances, down to 6e-5 of it
const LEAST: f32 = 1e-6; // exposure that settings take
const LOG_RANGE: vec2f = vec2f(-24.0, 24.0);

@group(0) @binding(0) var<storage, read> points: array<vec2f>; // see meter.wgsl
@group(0) @binding(1) var<storage, read_write> exposure: array<f32>;

var<workgroup> sums: array<vec2f, LANES>; // of squared light, and of points on skin
var<workgroup> over: atomic<u32>;

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

// Radiance that no more points exceed than may clip.
fn highlights(lane: u32, brightness: array<f32, OF_LANE>) -> f32 {
    var logs = brightness; // indexed by a variable
    let most = u32(CLIPPING * sums[0].y);
    var low = LOG_RANGE.x;
    var high = LOG_RANGE.y;
    for (var k = 0u; k < HALVINGS; k += 1u) {
        let middle = 0.5 * (low + high);
        if (lane == 0u) {
            atomicStore(&over, 0u);
        }
        workgroupBarrier();
        var count = 0u;
        for (var i = 0u; i < OF_LANE; i += 1u) {
            count += u32(logs[i] > middle);
        }
        if (count > 0u) {
            atomicAdd(&over, count);
        }
        workgroupBarrier();
        let brighter = atomicLoad(&over) > most;
        low = select(low, middle, brighter);
        high = select(middle, high, brighter);
        workgroupBarrier();
    }
    return exp2(high);
}

@compute @workgroup_size(LANES)
fn main(@builtin(local_invocation_index) lane: u32) {
    var brightness: array<f32, OF_LANE>; // logarithms
    var sum = vec2f(0.0);
    for (var i = 0u; i < OF_LANE; i += 1u) {
        let point = points[lane + i * LANES];
        let on_skin = point.x >= 0.0;
        sum += select(vec2f(0.0), vec2f(point.x * point.x, 1.0), on_skin);
        brightness[i] = select(LOG_RANGE.x, log2(max(point.y, 1e-7)), on_skin);
    }
    sums[lane] = sum;
    let light = root_mean_square(lane);
    let limit = 1.0 / highlights(lane, brightness);
    if (lane == 0u) {
        let wanted = KEY / light;
        // Without light or skin there is nothing to go by.
        let found = clamp(clamp(limit, STOPPED_DOWN * wanted, wanted), LEAST, 1.0 / LEAST);
        exposure[0] = select(found, 1.0, light == 0.0);
    }
}
