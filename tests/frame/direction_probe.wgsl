// What a half-space does by directions, for pairs of cosines.
//#include "irradiance/direction.wgsl"

@group(0) @binding(30) var cosines: texture_2d<f32>; // of coming in, of leaving
@group(0) @binding(31) var back: texture_storage_2d<rgba32float, write>;
@group(0) @binding(32) var beyond: texture_storage_2d<rgba32float, write>;
@group(0) @binding(33) var around: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let given = textureLoad(cosines, id.xy, 0);
    textureStore(back, id.xy, vec4f(relative_reflectance(given.x), 0.0));
    textureStore(beyond, id.xy, vec4f(directional_excess(given.x, given.y), 0.0));
    textureStore(around, id.xy, vec4f(uniform_directional_excess(given.y), 0.0));
}
