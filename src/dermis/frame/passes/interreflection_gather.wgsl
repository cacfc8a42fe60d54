// What enters each cell of the uv square of the light that patches of the skin send it through the air.
//#include "each.wgsl"

override MEAN: bool = false; // whether the mean of what a cell sees is wanted, and not how much that is

@group(0) @binding(0) var<storage, read> first: array<u32>; // where the links of each cell begin
@group(0) @binding(1) var<storage, read> links: array<vec2u>; // patch, form factor
@group(0) @binding(2) var<storage, read> cells: array<vec2u>; // the patch that each belongs to, and how well it is known
@group(0) @binding(3) var<storage, read> patches: array<vec4f>; // light that leaves, and the share of light from everywhere that enters
@group(0) @binding(4) var<storage, read_write> from_skin: array<vec4f>; // as interreflection.wgsl reads it

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&from_skin)) {
        return;
    }
    var sum = vec4f(0.0); // light, and the share of the hemisphere that it comes from
    let end = min(first[index + 1u], arrayLength(&links));
    for (var k = first[index]; k < end; k++) {
        let link = links[k];
        sum += bitcast<f32>(link.y) * vec4f(patches[link.x].rgb, 1.0);
    }
    let own = cells[index];
    let weight = select(1.0, sum.a, MEAN);
    from_skin[index] = bitcast<f32>(own.y) * vec4f(patches[own.x].a * sum.rgb, weight);
}
