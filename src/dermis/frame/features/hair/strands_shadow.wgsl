// How much of each light hairs hold back: first how deep the nearest of each coarse texel lies, then what those of each layer
// behind that cover. Whole numbers are added up, so that the order does not matter.
//#include "each.wgsl"
//#include "shape/geometry.wgsl"
//#include "surface/surface.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_window.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> splatted: array<atomic<u32>>; // see strand_window.wgsl

override COVERS: bool = false; // whether the nearest are known

override SPLAT_STEP: f32 = 1.0; // between places along a hair, at most [texel]; software adapters take longer ones

fn window_at(layer: i32) -> Window {
    let word = window_begin(layer);
    let low = vec3u(atomicLoad(&splatted[word]), atomicLoad(&splatted[word + 1u]), atomicLoad(&splatted[word + 2u]));
    let high = vec3u(atomicLoad(&splatted[word + 3u]), atomicLoad(&splatted[word + 4u]), atomicLoad(&splatted[word + 5u]));
    return window_around(low, high);
}

fn add(layer: i32, texel: vec2i, cover: f32, depth: f32) {
    if (any(texel < vec2i(0)) || any(texel >= vec2i(window_size()))) {
        return;
    }
    let word = window_word(layer, vec2u(texel));
    if (!COVERS) {
        let deep = u32(DEEP * max(depth, 0.0));
        if (deep < atomicLoad(&splatted[word])) { // few are nearer, and changes wait for each other
            atomicMin(&splatted[word], deep);
        }
        return;
    }
    let behind = depth - f32(atomicLoad(&splatted[word])) / DEEP;
    let which = u32(layers_before(behind));
    if (which < HAIR_LAYERS) { // what lies behind them all is on the head's other side, and would darken this one
        atomicAdd(&splatted[word + 1u + which], u32(cover * DENSE + 0.5));
    }
}

fn splat(light: Light, a: vec4f, b: vec4f, wider: f32) {
    let window = window_at(light.layer);
    let begin = in_window(window, on_map(light, a.xyz));
    let end = in_window(window, on_map(light, b.xyz));
    let right = in_window(window, on_map(light, a.xyz + light.map_right)).x - begin.x;
    let up = in_window(window, on_map(light, a.xyz + light.map_up)).y - begin.y;
    let way = b.xyz - a.xyz;
    let across = length(vec2f(dot(way, light.map_right), dot(way, light.map_up)));
    let count = max(1u, u32(ceil(distance(begin.xy, end.xy) / SPLAT_STEP)));
    let cover = wider * (a.w + b.w) * across * abs(right * up) / f32(count);
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
    if (index >= pieces_of(hairs.shading)) {
        return;
    }
    let hair = hair_of_piece(index);
    let row = row_of_knot(index + hair, hair);
    let wider = select(1.0, hairs.wider, is_coarse(hair));
    for (var i = 0u; i < skin.light_count; i += 1u) {
        if (lights.light[i].layer >= 0) {
            splat(lights.light[i], posed[row], posed[row + 1u], wider);
        }
    }
}
