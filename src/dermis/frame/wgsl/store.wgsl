// Light stored to a pyramid level, in the format of its texture.
//#if STORED_HALVES
// Half floats.
//#include "halves.wgsl"

@group(0) @binding(32) var stored: texture_storage_2d<rgba16float, write>;

fn store(at: vec2u, light: vec4f) {
    textureStore(stored, at, rounded_to_halves(light));
}
//#else
// 32-bit floats.

@group(0) @binding(32) var stored: texture_storage_2d<rgba32float, write>;

fn store(at: vec2u, light: vec4f) {
    textureStore(stored, at, light);
}
//#end
