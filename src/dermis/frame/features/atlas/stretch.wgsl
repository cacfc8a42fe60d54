// Stretch at each texel that a triangle covers.
//#include "texel_stretch.wgsl"
//#include "edges.wgsl"

@group(0) @binding(31) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(0) @binding(32) var edge_map: texture_2d<f32>; // distance to the nearest seam [texels]

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(atlas))) {
        return;
    }
    let texel = textureLoad(atlas, id.xy, 0);
    if (texel.x == 0u) {
        return;
    }
    let w = unpack2x16unorm(texel.y);
    var stretch = stretch_at(texel.x - 1u, vec3f(1.0 - w.x - w.y, w));
    if (FEATHER_MM > 0.0) {
        let away = edge_mm(textureLoad(edge_map, id.xy, 0).x, stretch.xy);
        stretch = vec3f(stretch.xy * clamp(away / FEATHER_MM, MIN_FRACTION, 1.0), stretch.z);
    }
    store_stretch(id.xy, stretch);
}
