// Light that enters the skin at each texel of the atlas, times the share of the colour map applied before scattering.
//#include "lighting.wgsl"

@group(1) @binding(0) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(1) @binding(1) var entered: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(atlas);
    if (any(id.xy >= size)) {
        return;
    }
    let texel = textureLoad(atlas, id.xy, 0);
    if (texel.x == 0u) {
        textureStore(entered, id.xy, vec4f(0.0));
        return;
    }
    let t = triangle_at(texel.x - 1u);
    let w = unpack2x16unorm(texel.y);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let point = interpolate(a, b, c, vec3f(1.0 - w.x - w.y, w), t.w);
    let surface = surface_at(point, maps_over_atlas(texel.x - 1u, a, b, c) / f32(size.x));
    let open = open_at((vec2f(id.xy) + 0.5) / vec2f(size));
    // The view is of no account: what is reflected is left out, and the compiler leaves out its computation.
    let lit = light_up(point, surface, surface.normal, open);
    textureStore(entered, id.xy, vec4f(lit.entered * share_of(surface.colour, skin.mix), 1.0));
}
