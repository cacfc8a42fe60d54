// Finds where hairs are on the shadow map of each light, a workgroup for each, and empties what they hold back there.
//#include "geometry.wgsl"
//#include "surface.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_window.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> windows: array<u32>; // see strand_window.wgsl

const LANES: u32 = 256u;
const NARROWEST: f32 = 0.2; // width of a window over its length, at least
const BORDER: f32 = 3.0; // texels around all hairs that stay empty

var<workgroup> lows: array<vec3f, LANES>;
var<workgroup> highs: array<vec3f, LANES>;

fn empty_texels(first: u32, step: u32) {
    let words = window_begin(1);
    for (var word = first; word < arrayLength(&windows); word += step) {
        let of_texel = word % words;
        if (of_texel >= WINDOW_HEAD) {
            windows[word] = select(0u, NO_HAIR, (of_texel - WINDOW_HEAD) % TEXEL_WORDS == 0u);
        }
    }
}

@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    empty_texels(group.x * LANES + lane, groups.x * LANES);
    if (group.x >= skin.light_count || lights.light[group.x].layer < 0) {
        return;
    }
    let light = lights.light[group.x];
    var low = vec3f(1e30);
    var high = vec3f(-1e30);
    let knots = hairs.fine * KNOTS + hairs.shading * COARSE_KNOTS;
    for (var k = lane; k < knots; k += LANES) {
        let at = on_map(light, posed[row_of_knot(k, hair_of_knot(k))].xyz);
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
    if (lane == 0u) {
        let span = highs[0].xy - lows[0].xy;
        let wide = max(span, vec2f(NARROWEST * max(span.x, span.y) + 1e-6)) * vec2f(window_size()) / (vec2f(window_size()) - 2.0 * BORDER);
        let corner = bitcast<vec2u>(0.5 * (highs[0].xy + lows[0].xy - wide));
        let size = bitcast<vec2u>(wide);
        let word = window_begin(light.layer);
        windows[word] = corner.x;
        windows[word + 1u] = corner.y;
        windows[word + 2u] = size.x;
        windows[word + 3u] = size.y;
        windows[word + 4u] = bitcast<u32>(lows[0].z);
    }
}
