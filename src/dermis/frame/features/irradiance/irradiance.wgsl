// Irradiance that enters the skin at each texel of the atlas, times the colour applied before scattering.
//#include "lighting.wgsl"
//#include "texels_beside.wgsl"
//#include "store.wgsl"

struct Entering {
    scale: f32, // factor of the stored values
    area: f32, // standard deviation of the filter of light finer than texels [texels]
}

@group(0) @binding(31) var<uniform> entering: Entering;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfaces);
    if (any(id.xy >= size)) {
        return;
    }
    let packed = packed_at(vec2i(id.xy));
    if (packed.appearance.w == 0u) {
        store(id.xy, vec4f(0.0));
        return;
    }
    let surface = unpack_surface(packed);
    if (STRIPE_LIGHT && entering.area > 0.0) {
        area_u = entering.area * texel_step(vec2i(id.xy), packed.geometry, vec2i(1, 0));
        area_v = entering.area * texel_step(vec2i(id.xy), packed.geometry, vec2i(0, 1));
    }
    var point = unpack_point(packed);
    point.atlas_uv = (vec2f(id.xy) + 0.5) / vec2f(size);
    if (OBLIQUE) {
        local_bend = bend_at(vec2i(id.xy), packed.geometry);
    }
    // the view direction is arbitrary, as the reflection is not used
    let lit = illuminate(point, surface, surface.normal, open_at(point.atlas_uv));
    store(id.xy, vec4f(entering.scale * lit.entered * colour_power(surface.colour, skin.mix), 1.0));
}
