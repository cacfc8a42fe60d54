// Empties the deep opacity map of the picture.
//#include "each.wgsl"
//#include "opacity_layers.wgsl"

@group(0) @binding(31) var<storage, read_write> opacity: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let word = list_index(group, groups, lane);
    if (word < arrayLength(&opacity)) {
        opacity[word] = select(0u, NO_HAIR, word % TEXEL_WORDS == 0u);
    }
}
