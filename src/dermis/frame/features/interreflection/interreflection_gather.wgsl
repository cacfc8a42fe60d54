// What enters each cell of the uv square of the light that patches of the skin send it through the air.
//#include "links.wgsl"

override MEAN: bool = false; // whether the mean of what a cell sees is wanted, and not how much that is

@group(0) @binding(0) var<storage, read> cells: array<vec2u>; // the patch that each belongs to, and how well it is known
@group(0) @binding(4) var<storage, read_write> from_skin: array<vec4f>; // as interreflection.wgsl reads it

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane) / TEAM;
    let here = index < arrayLength(&from_skin);
    let sum = gathered(index, here, lane);
    if (here && lane % TEAM == 0u) {
        let own = cells[index];
        let weight = select(1.0, sum.a, MEAN);
        from_skin[index] = bitcast<f32>(own.y) * vec4f(sent[own.x].a * sum.rgb, weight);
    }
}
