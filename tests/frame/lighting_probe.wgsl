// What the surface reflects of the scene's lights, for given normals, views and roughness.
//#include "irradiance/lighting.wgsl"

@group(0) @binding(30) var normals: texture_2d<f32>;
@group(0) @binding(31) var views: texture_2d<f32>; // and the roughness
@group(0) @binding(32) var mirror: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(normals))) {
        return;
    }
    let n = textureLoad(normals, id.xy, 0).xyz;
    let v = textureLoad(views, id.xy, 0);
    var point: Point;
    point.normal = n;
    let lit = illuminate(point, Surface(n, vec3f(1.0), v.w, 1.0), v.xyz, 1.0);
    textureStore(mirror, id.xy, vec4f(lit.reflected, 0.0));
}
