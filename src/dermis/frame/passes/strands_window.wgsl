// Empties what hairs hold back of each light, and finds the ball that holds all of them.
//#include "strand_knots.wgsl"

@group(0) @binding(0) var<storage, read> posed: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> strand_shadows: array<u32>; // see strand_window.wgsl

//#fill const HEAD: u32 = {strand_window_words};
const LANES: u32 = 256u;

var<workgroup> lows: array<vec3f, LANES>;
var<workgroup> highs: array<vec3f, LANES>;

@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    if (group.x > 0u) {
        for (var word = HEAD + (group.x - 1u) * LANES + lane; word < arrayLength(&strand_shadows); word += (groups.x - 1u) * LANES) {
            strand_shadows[word] = 0u;
        }
        return;
    }
    var low = vec3f(1e30);
    var high = vec3f(-1e30);
    let count = arrayLength(&posed) / rows_of_strand();
    for (var k = lane; k < 2u * count; k += LANES) { // the ends of each tell enough
        let p = posed[k / 2u * rows_of_strand() + KNOTS_FROM + (k % 2u) * (KNOTS - 1u)].xyz;
        low = min(low, p);
        high = max(high, p);
    }
    lows[lane] = low;
    highs[lane] = high;
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if (lane < step) {
            lows[lane] = min(lows[lane], lows[lane + step]);
            highs[lane] = max(highs[lane], highs[lane + step]);
        }
    }
    if (lane == 0u) {
        let middle = 0.5 * (lows[0] + highs[0]);
        strand_shadows[0] = bitcast<u32>(middle.x);
        strand_shadows[1] = bitcast<u32>(middle.y);
        strand_shadows[2] = bitcast<u32>(middle.z);
        strand_shadows[3] = bitcast<u32>(0.5 * length(highs[0] - lows[0]) + 1.0);
    }
}
