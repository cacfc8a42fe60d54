// Fraction of the sky that points see through a polygon of lips.
struct Shade {
    lips: array<vec4f, 38>,
    teeth_below_lip: vec3f,
}

const PI: f32 = 3.14159265358979;

@group(0) @binding(30) var<uniform> shade: Shade;
@group(0) @binding(31) var points: texture_2d<f32>;
@group(0) @binding(32) var normals: texture_2d<f32>;
@group(0) @binding(33) var open: texture_storage_2d<rgba32float, write>;
//#include "shading/lips.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(points))) {
        let found = open_between_lips(textureLoad(points, id.xy, 0).xyz, textureLoad(normals, id.xy, 0).xyz, shade.teeth_below_lip, 0.25);
        textureStore(open, id.xy, vec4f(found));
    }
}
