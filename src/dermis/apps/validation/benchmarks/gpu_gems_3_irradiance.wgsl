// Light that enters the skin at each texel of the atlas, as irradiance.wgsl has it, as fragments of a render pass.
//#include "full_screen_triangle.wgsl"
//#include "irradiance/lighting.wgsl"
//#include "surface/packed_surface.wgsl"

struct Entering {
    scale: f32, // of what is stored over the light
}

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // as surface_texels.wgsl packs them
@group(0) @binding(31) var<uniform> entering: Entering;

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let texel = vec2u(at.xy);
    let packed = Packed(textureLoad(surfaces, texel, 0, 0), textureLoad(surfaces, texel, 1, 0));
    if (packed.look.w == 0u) {
        return vec4f(0.0);
    }
    let surface = unpack_surface(packed);
    var point = unpack_point(packed);
    point.place = at.xy / vec2f(textureDimensions(surfaces));
    let lit = light_up(point, surface, surface.normal, open_at(point.place));
    return vec4f(entering.scale * lit.entered * share_of(surface.colour, skin.mix), 1.0);
}
