// Depth of the nearest surface as a light sees it.
//#include "geometry.wgsl"

struct View {
    clip: mat4x4f,
}

@group(1) @binding(0) var<uniform> view: View;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return view.clip * vec4f(position_of(triangle_at(index / 3u)[index % 3u]), 1.0);
}
