// Outputs of light: what the centre of each pixel shows, by the parts of the picture's own shading.
//#include "shading/shading.wgsl"
//#include "surface_hit.wgsl"
//#include "planes.wgsl"

//#include <light_outputs>
//#each light_outputs: override {NAME}_FIRST: u32 = UNASKED;

@group(0) @binding(34) var subsurface: texture_storage_2d_array<rgba32float, write>; // light below, depth; share of it that leaves

struct Parts {
    shading_point: ShadingPoint,
    lit: Lit,
    shaded: Shaded,
}

// Of the whole pixel.
fn parts_at(pixel: vec2u, size: vec2u) -> Parts {
    let triangle = max(textureLoad(centres, pixel, 0, 0).x, 1u) - 1u;
    let shading_point = shading_point_at(triangle, vec2f(pixel) + 0.5, 1.0, vec2f(size));
    let lit = lit_at(shading_point);
    return Parts(shading_point, lit, shaded(shading_point, lit));
}

// What lids hold back is in an eye's colour, and here in the light that it gets.
fn albedo_output(parts: Parts) -> vec3f {
    return select(shade.total, vec3f(1.0), is_opaque(parts.shading_point.point)) * parts.shading_point.surface.colour / parts.shading_point.lids;
}

fn irradiance_output(parts: Parts) -> vec3f {
    return parts.lit.entered * parts.shading_point.lids;
}

// Where light spreads over the picture, what spreads is added when it has.
fn diffuse_output(parts: Parts) -> vec3f {
    let one = parts.shaded;
    return select(one.below * one.leaving, vec3f(0.0), SPLIT) + one.local;
}

fn specular_output(parts: Parts) -> vec3f {
    return parts.shaded.reflected;
}

// The share that leaves towards the eye, to be multiplied by the light through thin parts.
fn translucent_output(parts: Parts) -> vec3f {
    return parts.shaded.leaving;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let there = sees_any(id.xy);
    let cell = cell_of(id.xy, size);
    var parts: Parts;
    if (there) {
        parts = parts_at(id.xy, size);
    }
    if (SPLIT) {
        textureStore(subsurface, id.xy, 0, vec4f(parts.shaded.below, parts.shaded.depth));
        textureStore(subsurface, id.xy, 1, vec4f(parts.shaded.leaving, 0.0));
    }
    //#each light_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(parts), there)); }}
}
