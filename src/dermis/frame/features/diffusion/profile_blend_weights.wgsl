// Blend weights of all profiles but the first at each texel of the atlas, from a map over uv.
//#include "shape/geometry.wgsl"
//#include "store.wgsl"

@group(0) @binding(3) var map_sampler: sampler;
@group(0) @binding(4) var weight_map: texture_2d<f32>; // filtered
@group(0) @binding(30) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(atlas);
    if (any(id.xy >= size)) {
        return;
    }
    let texel = textureLoad(atlas, id.xy, 0);
    if (texel.x == 0u) {
        store(id.xy, vec4f(0.0));
        return;
    }
    let t = triangle_at(texel.x - 1u);
    let w = unpack2x16unorm(texel.y);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let uv = (1.0 - w.x - w.y) * a.uv + w.x * b.uv + w.y * c.uv;
    let sides = vec2f(textureDimensions(weight_map));
    let footprint = maps_over_atlas(texel.x - 1u, a, b, c) / f32(size.x) * max(sides.x, sides.y);
    let weights = textureSampleLevel(weight_map, map_sampler, uv, max(0.0, log2(footprint)));
    store(id.xy, vec4f(weights.xy, 0.0, 1.0));
}
