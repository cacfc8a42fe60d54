// Light that enters the skin at each texel of the atlas, times the share of the colour map applied before scattering.
//#include "lighting.wgsl"

@group(1) @binding(0) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(1) @binding(1) var stretch_map: texture_2d<f32>; // texels per mm along u, v
@group(1) @binding(2) var entered: texture_storage_2d<rgba32float, write>;

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
    let point = interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), vec3f(1.0 - w.x - w.y, w), t.w);
    let texel_mm = 1.0 / textureLoad(stretch_map, id.xy, 0).x;
    let surface = surface_at(point, texel_mm / max(length(point.dpdu), 1e-3));
    let open = open_at((vec2f(id.xy) + 0.5) / vec2f(size));
    // The view is of no account: what is reflected is left out, and the compiler leaves out its computation.
    let lit = light_up(point, surface, surface.normal, open);
    textureStore(entered, id.xy, vec4f(lit.entered * share_of(surface.colour, skin.mix), 1.0));
}
