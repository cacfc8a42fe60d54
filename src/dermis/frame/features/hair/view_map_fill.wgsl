// Fills the deep opacity map of the picture with the strands that cast shadows, which stand for all strands: first the depth of
// the nearest strand in each texel, then the cover of each layer behind this depth.
//#include "each.wgsl"
//#include "strand_knots.wgsl"
//#include "view_map.wgsl"
//#include "opacity_cover.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;

const MAX_STEPS: u32 = 64u; // points along a segment

fn add_cover(texel: vec2i, cover: f32, depth: f32) {
    if (all(texel >= vec2i(0)) && all(texel < view_map_size())) {
        add_cover_to(view_map_word(texel), cover, depth);
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
    let a = project_knot(posed[row].xyz, posed[row].w);
    let b = project_knot(posed[row + 1u].xyz, posed[row + 1u].w);
    if (!is_coarse(hair) || posed[row].w < 0.0 || a.width < 0.0 || b.width < 0.0) {
        return;
    }
    let extent = distance(a.position, b.position) / VIEW_TEXEL;
    let count = clamp(u32(ceil(extent)), 1u, MAX_STEPS);
    let cover = 0.5 * (a.width + b.width) / VIEW_TEXEL * extent / f32(count);
    for (var k = 0u; k < count; k += 1u) {
        let t = (f32(k) + 0.5) / f32(count);
        let position = mix(a.position, b.position, t) / VIEW_TEXEL - 0.5;
        let depth = mix(a.depth, b.depth, t);
        let corner = vec2i(floor(position));
        let f = position - floor(position);
        add_cover(corner, cover * (1.0 - f.x) * (1.0 - f.y), depth);
        add_cover(corner + vec2i(1, 0), cover * f.x * (1.0 - f.y), depth);
        add_cover(corner + vec2i(0, 1), cover * (1.0 - f.x) * f.y, depth);
        add_cover(corner + vec2i(1, 1), cover * f.x * f.y, depth);
    }
}
