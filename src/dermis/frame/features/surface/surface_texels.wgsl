// Surface at each texel of the atlas: position, normals, colour and gloss.
//#include "packed_surface.wgsl"

@group(0) @binding(30) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(0) @binding(31) var surfaces: texture_storage_2d_array<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(atlas);
    if (any(id.xy >= size)) {
        return;
    }
    let texel = textureLoad(atlas, id.xy, 0);
    var packed = Packed(vec4u(0u), vec4u(0u));
    if (texel.x > 0u) {
        let t = triangle_at(texel.x - 1u);
        let w = unpack2x16unorm(texel.y);
        let a = corner_at(t.x);
        let b = corner_at(t.y);
        let c = corner_at(t.z);
        let point = interpolate(a, b, c, vec3f(1.0 - w.x - w.y, w), t.w);
        packed = pack_surface(point, surface_at(point, maps_over_atlas(texel.x - 1u, a, b, c) / f32(size.x)));
    }
    textureStore(surfaces, id.xy, 0, packed.geometry);
    textureStore(surfaces, id.xy, 1, packed.appearance);
}
