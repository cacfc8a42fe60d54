// Outputs of light at the centre of each pixel, computed by the functions that shade the picture.
//#include "shading/shading.wgsl"
//#include "surface_hit.wgsl"
//#include "output_images.wgsl"

//#include <light_outputs>
//#each light_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

@group(0) @binding(34) var subsurface: texture_storage_2d_array<rgba32float, write>; // light below the skin, depth; fraction of it that leaves

struct ShadedPixel {
    shading_point: ShadingPoint,
    lit: Lit,
    shaded: Shaded,
}

// Shading with the footprint of the whole pixel.
fn shade_centre(pixel: vec2u, size: vec2u) -> ShadedPixel {
    let triangle = max(textureLoad(centres, pixel, 0, 0).x, 1u) - 1u;
    let shading_point = shading_point_at(triangle, vec2f(pixel) + 0.5, 1.0, vec2f(size));
    let lit = lit_at(shading_point);
    return ShadedPixel(shading_point, lit, shaded(shading_point, lit));
}

fn albedo_output(shaded_pixel: ShadedPixel) -> vec3f {
    return select(shade.total, vec3f(1.0), is_opaque(shaded_pixel.shading_point.point)) * shaded_pixel.shading_point.surface.colour;
}

fn irradiance_output(shaded_pixel: ShadedPixel) -> vec3f {
    return shaded_pixel.lit.entered;
}

// Diffuse light; what is diffused over the picture is added afterwards, by spread.wgsl.
fn diffuse_output(shaded_pixel: ShadedPixel) -> vec3f {
    let one = shaded_pixel.shaded;
    return select(one.below * one.leaving, vec3f(0.0), SPLIT) + one.local;
}

fn specular_output(shaded_pixel: ShadedPixel) -> vec3f {
    return shaded_pixel.shaded.reflected;
}

// Fraction that leaves towards the eye; transmitted.wgsl multiplies it by the light through thin parts.
fn translucent_output(shaded_pixel: ShadedPixel) -> vec3f {
    return shaded_pixel.shaded.leaving;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let found_hit = is_hit(id.xy);
    let slot = pixel_slot(id.xy, size);
    var shaded_pixel: ShadedPixel;
    if (found_hit) {
        shaded_pixel = shade_centre(id.xy, size);
    }
    if (SPLIT) {
        textureStore(subsurface, id.xy, 0, vec4f(shaded_pixel.shaded.below, shaded_pixel.shaded.depth));
        textureStore(subsurface, id.xy, 1, vec4f(shaded_pixel.shaded.leaving, 0.0));
    }
    //#each light_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, select({nothing}, {name}_output(shaded_pixel), found_hit)); }}
}
