// Textures of an eye and of teeth with the colours of the frame.
//#include "shading/mouth.wgsl"

const IRIS: u32 = 0u;
const WHITE_OF_EYE: u32 = 1u; // 2 for upper teeth, 3 for lower ones
const EYE_UV_RADIUS: f32 = 0.49; // distance in uv from the middle that corresponds to half a turn from the axis

struct PartRequest {
    eye: Eye,
    part: u32,
    iris_radius_mm: f32, // half the side of the iris texture
    eyeball_radius_mm: f32,
}

@group(0) @binding(30) var<uniform> part_request: PartRequest;
@group(0) @binding(31) var part_texture: texture_storage_2d<rgba32float, write>;

fn on_iris(uv: vec2f) -> vec3f {
    return iris_colour(part_request.eye, clamped_to_iris(part_request.iris_radius_mm * (2.0 * uv - 1.0)));
}

fn on_white(uv: vec2f) -> vec3f {
    let across = uv - 0.5;
    let angle = min(length(across) / EYE_UV_RADIUS, 1.0) * PI;
    let turn = atan2(-across.y, across.x);
    return white_colour(part_request.eye, part_request.eyeball_radius_mm * vec3f(sin(angle) * cos(turn), sin(angle) * sin(turn), cos(angle)));
}

fn on_teeth(uv: vec2f) -> vec3f {
    var point: Point;
    point.uv = uv;
    point.normal = vec3f(0.0, 0.0, 1.0);
    point.dpdu = vec3f(1.0, 0.0, 0.0);
    point.dpdv = vec3f(0.0, 1.0, 0.0);
    return teeth_at(point, f32(part_request.part) - 1.0).colour;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(part_texture);
    if (any(id.xy >= size)) {
        return;
    }
    let uv = (vec2f(id.xy) + 0.5) / vec2f(size);
    var colour = vec3f(0.0);
    switch (part_request.part) {
        case IRIS: {
            colour = on_iris(uv);
        }
        case WHITE_OF_EYE: {
            colour = on_white(uv);
        }
        default: {
            colour = on_teeth(uv);
        }
    }
    textureStore(part_texture, id.xy, vec4f(colour, 1.0));
}
