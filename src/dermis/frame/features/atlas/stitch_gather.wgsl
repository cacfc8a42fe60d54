// Gathers the light of gutter texels from their sources into a list.
//#include "gutter.wgsl"
//#include "source.wgsl"

@group(0) @binding(1) var<storage, read_write> gathered: array<vec4f>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (index < arrayLength(&gutter)) {
        gathered[index] = source_at((gutter[index].source + 0.5) / vec2f(textureDimensions(source)));
    }
}
