// Adds the area of each segment of the strands that cast shadows to the cells of the grid of strand_sky.wgsl.
//#include "each.wgsl"
//#include "sky_grid.wgsl"

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= segment_count(hairs.shadow_casters)) {
        return;
    }
    let hair = hair_of_segment(index);
    let row = row_of_knot(index + hair, hair);
    let a = posed[row];
    let b = posed[row + 1u];
    let grid = sky_grid();
    if (min(a.w, b.w) < 0.0 || any(grid.cell <= vec3f(0.0))) {
        return;
    }
    let begin = (a.xyz - grid.low) / grid.cell;
    let end = (b.xyz - grid.low) / grid.cell;
    let count = max(1u, u32(ceil(2.0 * distance(begin, end))));
    let area = (a.w + b.w) * distance(a.xyz, b.xyz) / f32(count);
    for (var k = 0u; k < count; k += 1u) {
        let at = mix(begin, end, (f32(k) + 0.5) / f32(count));
        if (in_grid(at)) {
            atomicAdd(&opacity[content_word(sky_cell_index(vec3u(at)))], u32(AREA_SCALE * area + 0.5));
        }
    }
}
