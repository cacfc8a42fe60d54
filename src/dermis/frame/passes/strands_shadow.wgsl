// How much of each light hairs hold back: what they cover of coarse texels, and how deep they lie on average.
// Whole numbers are added up, so that the order does not matter.
//#include "each.wgsl"
//#include "geometry.wgsl"
//#include "surface.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_window.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> splatted: array<atomic<u32>>; // see strand_window.wgsl

const STEP: f32 = 0.7; // between places along a hair, at most [texel]

fn add(layer: i32, texel: vec2i, cover: f32, depth: f32) {
    if (all(texel >= vec2i(0)) && all(texel < vec2i(i32(WINDOW)))) {
        let word = window_word(layer, vec2u(texel));
        let much = u32(cover * DENSE + 0.5);
        atomicAdd(&splatted[word], much);
        atomicAdd(&splatted[word + 1u], u32(f32(much) * DEEP * max(depth, 0.0) + 0.5));
    }
}

fn splat(light: Light, window: Window, a: vec4f, b: vec4f) {
    let begin = in_window(light, window, a.xyz);
    let end = in_window(light, window, b.xyz);
    let beside = in_window(light, window, a.xyz + light.map_right);
    let run = distance(begin.xy, end.xy);
    let width = (a.w + b.w) * distance(begin.xy, beside.xy);
    let count = max(1u, u32(ceil(run / STEP)));
    let cover = width * run / f32(count);
    for (var k = 0u; k < count; k += 1u) {
        let at = mix(begin, end, (f32(k) + 0.5) / f32(count));
        let place = at.xy - 0.5;
        let corner = vec2i(floor(place));
        let f = place - floor(place);
        add(light.layer, corner, cover * (1.0 - f.x) * (1.0 - f.y), at.z);
        add(light.layer, corner + vec2i(1, 0), cover * f.x * (1.0 - f.y), at.z);
        add(light.layer, corner + vec2i(0, 1), cover * (1.0 - f.x) * f.y, at.z);
        add(light.layer, corner + vec2i(1, 1), cover * f.x * f.y, at.z);
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    let strand = index / (KNOTS - 1u);
    if (strand >= arrayLength(&posed) / rows_of_strand()) {
        return;
    }
    let ball = vec4f(
        bitcast<f32>(atomicLoad(&splatted[0])),
        bitcast<f32>(atomicLoad(&splatted[1])),
        bitcast<f32>(atomicLoad(&splatted[2])),
        bitcast<f32>(atomicLoad(&splatted[3])),
    );
    let row = strand * rows_of_strand() + KNOTS_FROM + index % (KNOTS - 1u);
    for (var i = 0u; i < skin.light_count; i += 1u) {
        if (lights.light[i].layer >= 0) {
            splat(lights.light[i], window_of(lights.light[i], ball), posed[row], posed[row + 1u]);
        }
    }
}
