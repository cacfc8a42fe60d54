// One axis of a blur of GPU Gems 3 as a fragment shader, for light and the stretch map.
//#include "full_screen_triangle.wgsl"
//#include "gpu_gems_3_taps.wgsl"

struct Outputs {
    @location(0) light: vec4f,
    @location(1) stretch: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Outputs {
    let blurred = blurred_at(position.xy / vec2f(textureDimensions(source)));
    return Outputs(blurred.light, blurred.stretch);
}
