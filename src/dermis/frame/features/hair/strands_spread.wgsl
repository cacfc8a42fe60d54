// Interpolates the radiance of the knots of coarse strands that strands_light.wgsl leaves out, from the knots before and after.
//#include "each.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_view.wgsl"

@group(0) @binding(31) var<storage, read_write> projected: array<ProjectedKnot>;

override STRIDE: u32 = 2u; // as in strands_light.wgsl

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = hairs.fine * hairs.fine_knots + list_index(group, groups, lane);
    if (index >= total_knot_count(strand_view.coarse)) {
        return;
    }
    let first = first_knot(hair_of_knot(index));
    let k = index - first;
    let before = k - k % STRIDE;
    let after = min(before + STRIDE, hairs.coarse_knots - 1u);
    if (k > before && k < after) {
        let t = f32(k - before) / f32(after - before);
        projected[index].radiance = mix(projected[first + before].radiance, projected[first + after].radiance, t);
    }
}
