// What one part of the first light gives at given points, and how much of the light they see.
//#include "shape/geometry.wgsl"
//#include "surface/skin.wgsl"
//#include "lights.wgsl"

struct Part {
    index: u32,
}

@group(0) @binding(30) var<uniform> part: Part;
@group(0) @binding(31) var points: texture_2d<f32>;
@group(0) @binding(32) var normals: texture_2d<f32>;
@group(0) @binding(33) var towards: texture_storage_2d<rgba32float, write>; // and the visibility
@group(0) @binding(34) var arriving: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(points))) {
        return;
    }
    var point: Point;
    point.position = textureLoad(points, id.xy, 0).xyz;
    point.lit_position = point.position;
    point.normal = textureLoad(normals, id.xy, 0).xyz;
    let light = lights.light[0];
    let one = incident(light, point.position, part.index);
    textureStore(towards, id.xy, vec4f(one.direction, visibility(light, point, one.direction)));
    textureStore(arriving, id.xy, vec4f(one.irradiance, 0.0));
}
