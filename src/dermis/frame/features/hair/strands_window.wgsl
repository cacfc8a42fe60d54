// Computes the bounds of all strands in space, and on the shadow map of each light: within each workgroup, then by atomic minima and maxima.
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

// Position whose bounds are computed: on the map of a light, or in space for the index after that of the last light.
fn bounded_position(i: u32, p: vec3f) -> vec3f {
    if (i == skin.light_count) {
        return p;
    }
    return project_to_map(lights.light[i], p);
}

fn find_bounds(i: u32, first: u32, lane: u32) {
    let begin = select(0u, hairs.fine * hairs.fine_knots, i == skin.light_count); // only coarse strands in space
    var low = vec3f(1e30);
    var high = vec3f(-1e30);
    let end = min(first + KNOTS, total_knot_count(hairs.shadow_casters));
    for (var k = max(first, begin) + lane; k < end; k += LANES) {
        let at = bounded_position(i, posed[row_of_knot(k, hair_of_knot(k))].xyz);
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
    for (var i = 0u; i <= skin.light_count; i += 1u) {
        let in_space = i == skin.light_count;
        let layer = lights.light[min(i, skin.light_count - 1u)].layer;
        if (in_space || layer >= 0) {
            find_bounds(i, group.x * KNOTS, lane);
            if (lane < 3u) {
                let word = select(first_word(layer), 0u, in_space) + lane;
                atomicMin(&opacity[word], sortable(lows[0])[lane]);
                atomicMax(&opacity[word + 3u], sortable(highs[0])[lane]);
            }
            workgroupBarrier();
        }
    }
}
