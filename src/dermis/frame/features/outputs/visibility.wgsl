// Fraction of each light that is visible at the centre of each pixel, where head and hair may cast shadows.
//#include "shading/shading.wgsl"
//#include "surface_hit.wgsl"
//#include "output_images.wgsl"

//#each visibility_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

struct LightParts {
    count: u32, // number of lights of the scene
    end: array<vec4u, 16>, // end of the parts of each light among the shaded ones, four per vector
}

@group(0) @binding(53) var<uniform> light_parts: LightParts;

// Visibility of a part of a light, 0 where the surface with relief faces away from all of the light.
fn part_visibility(light: Light, shading_point: ShadingPoint) -> f32 {
    for (var part = 0u; part < parts_of(light); part++) {
        let l = incident(light, shading_point.point.position, part).direction;
        if (dot(shading_point.surface.normal, l) > 0.0) {
            return saturate(total_visibility(light, shading_point.point, l));
        }
    }
    return 0.0;
}

fn write_visibility(shading_point: ShadingPoint, found_hit: bool, index: u32) {
    var part = 0u;
    for (var k = 0u; k < light_parts.count; k++) {
        let first = part;
        let end = light_parts.end[k / 4u][k % 4u];
        var sum = 0.0;
        for (; part < end; part++) {
            sum += part_visibility(lights.light[part], shading_point);
        }
        write_f32(0u, PixelSlot(VISIBILITY_FIRST + index * light_parts.count + k, 0u), select(0.0, sum / f32(end - first), found_hit));
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let triangle = max(textureLoad(centres, id.xy, 0, 0).x, 1u) - 1u;
    let shading_point = shading_point_at(triangle, vec2f(id.xy) + 0.5, 1.0, vec2f(size));
    write_visibility(shading_point, is_hit(id.xy), pixel_slot(id.xy, size).index);
}
