// Index into a list for an invocation in a grid of workgroups.

const EACH: u32 = 64u; // invocations of a workgroup

fn list_index(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * EACH + lane;
}
