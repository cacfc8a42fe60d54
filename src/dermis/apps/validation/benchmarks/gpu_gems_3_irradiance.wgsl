// Light that enters the skin at each texel of the atlas, as in irradiance.wgsl, as a fragment shader.
//#include "full_screen_triangle.wgsl"
//#include "irradiance/lighting.wgsl"
//#include "surface/packed_surface.wgsl"

struct Entering {
    scale: f32, // factor from light to stored value
}

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // as packed by surface_texels.wgsl
@group(0) @binding(31) var<uniform> entering: Entering;

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let texel = vec2u(position.xy);
    let packed = Packed(textureLoad(surfaces, texel, 0, 0), textureLoad(surfaces, texel, 1, 0));
    if (packed.appearance.w == 0u) {
        return vec4f(0.0);
    }
    let surface = unpack_surface(packed);
    var point = unpack_point(packed);
    point.atlas_uv = position.xy / vec2f(textureDimensions(surfaces));
    let lit = illuminate(point, surface, surface.normal, open_at(point.atlas_uv));
    return vec4f(entering.scale * lit.entered * colour_power(surface.colour, skin.mix), 1.0);
}
