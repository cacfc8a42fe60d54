// Blur of light and of the stretch map along one axis as published in 2007, including its known flaws.
//#include "gpu_gems_3_taps.wgsl"

@group(0) @binding(4) var blurred: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var stretch_blurred: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(source);
    if (any(id.xy >= size)) {
        return;
    }
    let found = blurred_at((vec2f(id.xy) + 0.5) / vec2f(size));
    textureStore(blurred, id.xy, found.light);
    textureStore(stretch_blurred, id.xy, found.stretch);
}
