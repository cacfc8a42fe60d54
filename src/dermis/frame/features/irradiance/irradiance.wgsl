// Light that enters the skin at each texel of the atlas, times the share of the colour map applied before scattering.
//#include "lighting.wgsl"
//#include "texels_beside.wgsl"
//#include "store.wgsl"

struct Entering {
    scale: f32, // factor from light to what is stored
    area: f32, // over which texels average light that is finer: standard deviation [texel]
}

@group(0) @binding(31) var<uniform> entering: Entering;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfaces);
    if (any(id.xy >= size)) {
        return;
    }
    let packed = packed_at(vec2i(id.xy));
    if (packed.look.w == 0u) {
        store(id.xy, vec4f(0.0));
        return;
    }
    let surface = unpack_surface(packed);
    if (STRIPE_LIGHT && entering.area > 0.0) {
        area_u = entering.area * texel_step(vec2i(id.xy), packed.place, vec2i(1, 0));
        area_v = entering.area * texel_step(vec2i(id.xy), packed.place, vec2i(0, 1));
    }
    var point = unpack_point(packed);
    point.place = (vec2f(id.xy) + 0.5) / vec2f(size);
    if (OBLIQUE) {
        bend_here = bend_at(vec2i(id.xy), packed.place);
    }
    // Any view will do: the reflection is not used, so the compiler drops it.
    let lit = light_up(point, surface, surface.normal, open_at(point.place));
    store(id.xy, vec4f(entering.scale * lit.entered * share_of(surface.colour, skin.mix), 1.0));
}
