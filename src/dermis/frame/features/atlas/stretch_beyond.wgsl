// Stretch of gutter texels, which is copied from the nearest point on the edge of the chart.
//#include "texel_stretch.wgsl"
//#include "each.wgsl"

struct StretchSource {
    texel: u32, // x and y packed
    triangle: u32, // of the nearest point on the edge
    weights: u32, // barycentric weights of that point, packed
}

@group(0) @binding(31) var<storage, read> stretch_sources: array<StretchSource>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&stretch_sources)) {
        return;
    }
    let source = stretch_sources[index];
    let w = unpack2x16unorm(source.weights);
    store_stretch(vec2u(source.texel & 0xffffu, source.texel >> 16u), stretch_at(source.triangle, vec3f(1.0 - w.x - w.y, w)));
}
