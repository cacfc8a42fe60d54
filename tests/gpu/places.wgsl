// The place of each texel of two targets, the second's by as many times as the override says.
//#include "full_screen_triangle.wgsl"

override TIMES: f32 = 1.0;

struct Places {
    @location(0) one: vec4f,
    @location(1) times: vec4f,
}

struct Added {
    more: vec4f,
}

@group(0) @binding(0) var<uniform> added: Added;

@fragment
fn fragment(@builtin(position) at: vec4f) -> Places {
    return Places(vec4f(at.xy, 0.0, 1.0), TIMES * vec4f(at.xy, 0.0, 1.0) + added.more);
}
