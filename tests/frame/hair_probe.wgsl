// The hair's lobe, and its albedo, for given directions and absorption.
//#include "hair.wgsl"

@group(0) @binding(0) var directions: texture_2d<f32>; // sines of light and view, the angle around, the absorption
@group(0) @binding(1) var seen: texture_storage_2d<rgba32float, write>;
@group(0) @binding(2) var white: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(directions))) {
        return;
    }
    let d = textureLoad(directions, id.xy, 0);
    let depth = d.w * vec3f(0.5, 1.0, 2.0);
    textureStore(seen, id.xy, vec4f(hair_scattered(d.x, d.y, d.z, depth), 0.0));
    let share = hair_albedo(d.y, depth);
    textureStore(white, id.xy, vec4f(share.reflected + share.transmitted + share.internal + share.residual, 0.0));
}
