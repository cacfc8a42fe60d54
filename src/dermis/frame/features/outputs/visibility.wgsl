// Share of each light that reaches what the centre of each pixel sees, past the head and its hairs.
//#include "shading/shading.wgsl"
//#include "surface_hit.wgsl"
//#include "planes.wgsl"

//#each visibility_outputs: override {NAME}_FIRST: u32 = UNASKED;

struct Given {
    count: u32, // of lights as they were given
    end: array<vec4u, 16>, // of each, beyond its last part among those that are shaded; four side by side
}

@group(0) @binding(53) var<uniform> given: Given;

// 0 where the surface with its relief faces away from all of the light.
fn share_of_part(light: Light, shading_point: ShadingPoint) -> f32 {
    for (var part = 0u; part < parts_of(light); part++) {
        let l = incident(light, shading_point.point.position, part).direction;
        if (dot(shading_point.surface.normal, l) > 0.0) {
            return saturate(reaching(light, shading_point.point, l));
        }
    }
    return 0.0;
}

fn put_shares(shading_point: ShadingPoint, there: bool, index: u32) {
    var part = 0u;
    for (var k = 0u; k < given.count; k++) {
        let first = part;
        let end = given.end[k / 4u][k % 4u];
        var sum = 0.0;
        for (; part < end; part++) {
            sum += share_of_part(lights.light[part], shading_point);
        }
        put_f32(0u, Cell(VISIBILITY_FIRST + index * given.count + k, 0u), select(0.0, sum / f32(end - first), there));
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
    put_shares(shading_point, sees_any(id.xy), cell_of(id.xy, size).index);
}
