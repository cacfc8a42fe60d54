// Empties the linked lists of all tiles.
//#include "each.wgsl"

@group(0) @binding(0) var<storage, read_write> list_heads: array<u32>; // number of links in use, then the first link + 1 of each list

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index < arrayLength(&list_heads)) {
        list_heads[index] = 0u;
    }
}
