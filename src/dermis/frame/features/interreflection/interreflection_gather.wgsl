// Irradiance of each cell of the uv square by the light of all patches that the cell sees.
//#include "links.wgsl"

override MEAN: bool = false; // whether to store the mean radiance of the patches in view, instead of the sum by form factors

@group(0) @binding(0) var<storage, read> cells: array<vec2u>; // patch of each cell, and confidence of its form factors
@group(0) @binding(4) var<storage, read_write> from_skin: array<vec4f>; // see interreflection.wgsl

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane) / TEAM;
    let is_cell = index < arrayLength(&from_skin);
    let sum = gathered(index, is_cell, lane);
    if (is_cell && lane % TEAM == 0u) {
        let own = cells[index];
        let weight = select(1.0, sum.a, MEAN);
        from_skin[index] = bitcast<f32>(own.y) * vec4f(exitance[own.x].a * sum.rgb, weight);
    }
}
