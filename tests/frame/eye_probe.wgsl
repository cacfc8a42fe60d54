// Where rays that meet the cornea see the plane of the iris, in an eye's own space, what share of its colour shows, and the light
// that reaches a point of the iris.
//#include "irradiance/lighting.wgsl"
//#include "shading/eye.wgsl"

@group(0) @binding(30) var places: texture_2d<f32>; // on the cornea [mm]
@group(0) @binding(31) var ways: texture_2d<f32>; // of sight, unit
@group(0) @binding(32) var seen: texture_storage_2d<rgba32float, write>;

@group(0) @binding(33) var iris_light: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(places))) {
        let p = textureLoad(places, id.xy, 0).xyz;
        textureStore(seen, id.xy, vec4f(refracted_to_iris(p, textureLoad(ways, id.xy, 0).xyz), IRIS_FACTOR, 0.0));
        let below = BelowCornea(vec3f(p.xy, 0.0) / IRIS_MM, vec3f(0.0, 0.0, 1.0), 1.0);
        let l = textureLoad(ways, id.xy, 0).xyz;
        textureStore(iris_light, id.xy, vec4f(l.z * light_below_cornea(below, l, l.z), sky_below_cornea(below), 0.0, 0.0));
    }
}
