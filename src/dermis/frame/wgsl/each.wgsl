// Index of an invocation in a grid of workgroups over a long list.

const EACH: u32 = 64u; // invocations of a workgroup

fn number_of(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * EACH + lane;
}
