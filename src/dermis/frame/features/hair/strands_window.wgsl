// Computes the bounds of all strands on the shadow map of each light: within each workgroup, then by atomic minima and maxima.
//#include "shape/geometry.wgsl"
//#include "surface/surface.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_window.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> opacity: array<atomic<u32>>; // see strand_window.wgsl

//#fill const KNOTS: u32 = {strand_window_knots}; // of a workgroup
const LANES: u32 = 256u;

var<workgroup> lows: array<vec3f, LANES>;
var<workgroup> highs: array<vec3f, LANES>;

fn find_bounds(light: Light, first: u32, lane: u32) {
    var low = vec3f(1e30);
    var high = vec3f(-1e30);
    let end = min(first + KNOTS, total_knot_count(hairs.shadow_casters));
    for (var k = first + lane; k < end; k += LANES) {
        let at = project_to_map(light, posed[row_of_knot(k, hair_of_knot(k))].xyz);
        low = min(low, at);
        high = max(high, at);
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
    workgroupBarrier();
}

@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    for (var i = 0u; i < skin.light_count; i += 1u) {
        let light = lights.light[i];
        if (light.layer >= 0) {
            find_bounds(light, group.x * KNOTS, lane);
            if (lane < 3u) {
                let word = first_word(light.layer) + lane;
                atomicMin(&opacity[word], sortable(lows[0])[lane]);
                atomicMax(&opacity[word + 3u], sortable(highs[0])[lane]);
            }
            workgroupBarrier();
        }
    }
}
