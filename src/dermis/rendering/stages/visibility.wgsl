// Which triangle each sample of the image sees: its index plus one, 0 for the background.
//#include "geometry.wgsl"

struct View {
    clip: mat4x4f,
}

@group(1) @binding(0) var<uniform> view: View;

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Seen {
    let corner = position_of(triangle_at(index / 3u)[index % 3u]);
    return Seen(view.clip * vec4f(corner, 1.0), index / 3u);
}

@fragment
fn fragment(seen: Seen) -> @location(0) u32 {
    return seen.triangle + 1u;
}
