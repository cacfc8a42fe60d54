// Light from the environment for given normals and views: what enters a partly open surface, and its mirror image.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "surface/skin.wgsl"
//#include "environment.wgsl"

@group(0) @binding(30) var normals: texture_2d<f32>; // and the open share of the sky
@group(0) @binding(31) var smooth_normals: texture_2d<f32>; // and the albedo
@group(0) @binding(32) var views: texture_2d<f32>; // and the roughness
@group(0) @binding(33) var around: texture_storage_2d<rgba32float, write>;
@group(0) @binding(34) var mirror: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(normals))) {
        return;
    }
    let n = textureLoad(normals, id.xy, 0);
    let s = textureLoad(smooth_normals, id.xy, 0);
    let v = textureLoad(views, id.xy, 0);
    var point: Point;
    point.normal = s.xyz;
    textureStore(around, id.xy, vec4f(ambient(n.xyz, n.w, vec3f(s.w)), 0.0));
    textureStore(mirror, id.xy, vec4f(mirrored(point, n.xyz, v.xyz, v.w, n.w), 0.0));
}
