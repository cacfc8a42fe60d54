// One axis of one blur as published in 2007, as fragments of a render pass: light and the stretch map.
//#include "full_screen_triangle.wgsl"
//#include "gpu_gems_3_taps.wgsl"

struct Stored {
    @location(0) light: vec4f,
    @location(1) stretch: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Stored {
    let found = blurred_at(at.xy / vec2f(textureDimensions(source)));
    return Stored(found.light, found.stretch);
}
