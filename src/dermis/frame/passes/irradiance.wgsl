// Light that enters the skin at each texel of the atlas, times the share of the colour map applied before scattering.
//#include "lighting.wgsl"
//#include "packed_surface.wgsl"
//#include "store.wgsl"

struct Entering {
    scale: f32, // factor from light to what is stored
}

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // as surface_texels.wgsl packs them
@group(0) @binding(31) var<uniform> entering: Entering;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfaces);
    if (any(id.xy >= size)) {
        return;
    }
    let packed = Packed(textureLoad(surfaces, id.xy, 0, 0), textureLoad(surfaces, id.xy, 1, 0));
    if (packed.look.w == 0u) {
        store(id.xy, vec4f(0.0));
        return;
    }
    let surface = unpack_surface(packed);
    let open = open_at((vec2f(id.xy) + 0.5) / vec2f(size));
    // Any view will do: the reflection is not used, so the compiler drops it.
    let lit = light_up(unpack_point(packed), surface, surface.normal, open);
    store(id.xy, vec4f(entering.scale * lit.entered * share_of(surface.colour, skin.mix), 1.0));
}
