// Replaces, near the seams of one atlas layout, its light by the light of a second layout with other seams; the transition is
// smooth.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "edges.wgsl"

override FADE_MM: f32; // width of the fade

@group(0) @binding(30) var atlas: texture_2d<u32>; // of the first layout: triangle + 1, two barycentric weights packed
@group(0) @binding(31) var edge_map: texture_2d<f32>; // distance to the nearest seam [texel]
@group(0) @binding(35) var stretch_map: texture_2d<f32>;
@group(0) @binding(32) var first: texture_2d<f32>;
@group(0) @binding(33) var second: texture_2d<f32>; // light in the layout whose coordinates the triangle table has
@group(0) @binding(34) var blended: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(atlas))) {
        return;
    }
    let own = textureLoad(first, id.xy, 0);
    let texel = textureLoad(atlas, id.xy, 0);
    if (texel.x == 0u) {
        textureStore(blended, id.xy, own);
        return;
    }
    let w = unpack2x16unorm(texel.y);
    let other = load_bilinear(second, atlas_position(texel.x - 1u, vec3f(1.0 - w.x - w.y, w)));
    let own_weight = smoothstep(0.0, FADE_MM, edge_mm(textureLoad(edge_map, id.xy, 0).x, textureLoad(stretch_map, id.xy, 0).xy));
    textureStore(blended, id.xy, vec4f(mix(other.rgb, own.rgb, own_weight), own.a)); // a: packed weights where profiles are mixed
}
