// The relief's normal and roughness, and how much of the first light arrives, at each texel of the atlas.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "surface/skin.wgsl"
//#include "surface/lobe.wgsl"
//#include "lights.wgsl"

struct Footprint {
    side: f32, // of the uv square's side
}

@group(0) @binding(30) var atlas: texture_2d<u32>;
@group(0) @binding(31) var<uniform> footprint: Footprint;
@group(0) @binding(32) var relief: texture_storage_2d<rgba32float, write>; // normal, roughness
@group(0) @binding(33) var arriving: texture_storage_2d<rgba32float, write>; // visibility, cosine of the smooth normal

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(atlas))) {
        return;
    }
    let texel = textureLoad(atlas, id.xy, 0);
    if (texel.x == 0u) {
        textureStore(relief, id.xy, vec4f(0.0));
        textureStore(arriving, id.xy, vec4f(0.0));
        return;
    }
    let t = triangle_at(texel.x - 1u);
    let w = unpack2x16unorm(texel.y);
    let point = interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), vec3f(1.0 - w.x - w.y, w), t.w);
    let surface = surface_at(point, footprint.side);
    textureStore(relief, id.xy, vec4f(surface.normal, surface.roughness));
    let light = lights.light[0];
    let l = incident(light, point.position, 0u).direction;
    textureStore(arriving, id.xy, vec4f(visibility(light, point, l), dot(point.normal, l), 0.0, 0.0));
}
