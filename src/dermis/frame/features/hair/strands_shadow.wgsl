// Fills the deep opacity maps of lights: first the depth of the nearest strand in each texel, then the cover of each layer behind
// this depth.
//#include "each.wgsl"
//#include "shape/geometry.wgsl"
//#include "surface/surface.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_window.wgsl"
//#include "opacity_cover.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;

const SPREAD: f32 = 3.0; // see `splat`, relative to the radius of a strand

override SPLAT_STEP: f32 = 1.0; // largest step along a strand [texel]; longer on software adapters

fn window_at(layer: i32) -> Window {
    let word = first_word(layer);
    let low = vec3u(atomicLoad(&opacity[word]), atomicLoad(&opacity[word + 1u]), atomicLoad(&opacity[word + 2u]));
    let high = vec3u(atomicLoad(&opacity[word + 3u]), atomicLoad(&opacity[word + 4u]), atomicLoad(&opacity[word + 5u]));
    return make_window(low, high);
}

fn add_cover(layer: i32, texel: vec2i, cover: f32, depth: f32) {
    if (any(texel < vec2i(0)) || any(texel >= vec2i(window_size()))) {
        return;
    }
    add_cover_to(texel_word(layer, vec2u(texel)), cover, depth);
}

// Number from -1 to 1 that varies irregularly with an index.
fn scattered(index: u32) -> f32 {
    let word = (index * 747796405u + 2891336453u) ^ (index >> 7u);
    return f32((word * 277803737u) >> 8u) / 8388608.0 - 1.0;
}

// spread : distance to the sides over which the cover is scattered [mm]: a strand stands for several that lie around it
fn splat(light: Light, a: vec4f, b: vec4f, spread: f32, seed: u32) {
    let window = window_at(light.layer);
    let begin = to_window(window, project_to_map(light, a.xyz));
    let end = to_window(window, project_to_map(light, b.xyz));
    let right = to_window(window, project_to_map(light, a.xyz + light.map_right)).x - begin.x;
    let up = to_window(window, project_to_map(light, a.xyz + light.map_up)).y - begin.y;
    let direction = b.xyz - a.xyz;
    let across = length(vec2f(dot(direction, light.map_right), dot(direction, light.map_up)));
    let count = max(1u, u32(ceil(distance(begin.xy, end.xy) / SPLAT_STEP)));
    let cover = (a.w + b.w) * across * abs(right * up) / f32(count);
    let extent = end.xy - begin.xy;
    let aside = spread * vec2f(-extent.y, extent.x) / max(length(extent), 1e-6) * abs(vec2f(right, up));
    for (var k = 0u; k < count; k += 1u) {
        let at = mix(begin, end, (f32(k) + 0.5) / f32(count));
        let position = at.xy - 0.5 + scattered(64u * seed + k) * aside;
        let corner = vec2i(floor(position));
        let f = position - floor(position);
        add_cover(light.layer, corner, cover * (1.0 - f.x) * (1.0 - f.y), at.z);
        add_cover(light.layer, corner + vec2i(1, 0), cover * f.x * (1.0 - f.y), at.z);
        add_cover(light.layer, corner + vec2i(0, 1), cover * (1.0 - f.x) * f.y, at.z);
        add_cover(light.layer, corner + vec2i(1, 1), cover * f.x * f.y, at.z);
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= segment_count(hairs.shadow_casters)) {
        return;
    }
    let hair = hair_of_segment(index);
    let row = row_of_knot(index + hair, hair);
    if (min(posed[row].w, posed[row + 1u].w) < 0.0) { // does not grow, or is below headwear
        return;
    }
    let spread = select(0.0, SPREAD * posed[row].w * (1.0 - 1.0 / max(hairs.width_scale, 1.0)), is_coarse(hair));
    for (var i = 0u; i < skin.light_count; i += 1u) {
        if (lights.light[i].layer >= 0) {
            splat(lights.light[i], posed[row], posed[row + 1u], spread, index);
        }
    }
}
