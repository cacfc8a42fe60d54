// Light beyond a chart's edge, gathered into a list from where the surface truly goes on.
//#include "apron.wgsl"
//#include "source.wgsl"

@group(0) @binding(1) var<storage, read_write> gathered: array<vec4f>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (index < arrayLength(&apron)) {
        gathered[index] = source_at((apron[index].source + 0.5) / vec2f(textureDimensions(source)));
    }
}
