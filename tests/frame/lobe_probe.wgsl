// The lobe's functions one by one, for given directions and roughness about the normal +Z.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "surface/skin.wgsl"
//#include "surface/lobe.wgsl"

@group(0) @binding(30) var to_light: texture_2d<f32>; // and the roughness
@group(0) @binding(31) var to_eye: texture_2d<f32>; // and rho_s
@group(0) @binding(32) var reflected: texture_storage_2d<rgba32float, write>;
@group(0) @binding(33) var passed: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(to_light))) {
        return;
    }
    let l = textureLoad(to_light, id.xy, 0);
    let v = textureLoad(to_eye, id.xy, 0);
    let up = vec3f(0.0, 0.0, 1.0);
    let slopes = beckmann_by_table(l.z, l.w);
    textureStore(reflected, id.xy, vec4f(fresnel(l.z), slopes, lobe(up, l.xyz, v.xyz, l.w), 0.0));
    let shares = vec2f(enters(l.z, l.w, v.w), enters_uniform(l.w, v.w));
    textureStore(passed, id.xy, vec4f(shares, leaves(v.z, l.w, v.w), 0.0));
}
