// Smooths the displacement from rest along each guide. Knots far from the skin need this, because the quads that they follow
// may change abruptly along the guide, such as from the jaw to the shoulder. Knots near the skin are not moved.
//#include "each.wgsl"

//#fill const KNOTS_PER_GUIDE: u32 = {knots_per_guide}; // of each guide
const REACH: i32 = 8; // knots on either side that a knot is averaged with
const NEAR_MM: f32 = 2.0; // height above the skin up to which knots keep their place
const FAR_MM: f32 = 18.0; // height from which they are smoothed fully

@group(0) @binding(0) var<storage, read> guide_rest: array<vec4f>; // see guides_pose.wgsl
@group(0) @binding(1) var<storage, read> bound_guides: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> guides: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&guide_rest)) {
        return;
    }
    let first = index - index % KNOTS_PER_GUIDE;
    let rest = guide_rest[index];
    var sum = vec3f(0.0);
    var total = 0.0;
    for (var step = -REACH; step <= REACH; step += 1) {
        let at = first + u32(clamp(i32(index - first) + step, 0, i32(KNOTS_PER_GUIDE) - 1));
        let weight = 1.0 - f32(abs(step)) / f32(REACH + 1);
        sum += weight * (bound_guides[2u * at].xyz - guide_rest[at].xyz);
        total += weight;
    }
    let bound = bound_guides[2u * index];
    let smooth_position = rest.xyz + sum / total;
    let far = smoothstep(NEAR_MM, FAR_MM, rest.w);
    guides[2u * index] = vec4f(mix(bound.xyz, smooth_position, far), rest.w);
    guides[2u * index + 1u] = bound_guides[2u * index + 1u];
}
