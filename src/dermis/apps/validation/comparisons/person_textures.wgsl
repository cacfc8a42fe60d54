// Colours of an eye and of teeth as pictures, as the frame shades them.
//#include "shading/mouth.wgsl"

const IRIS: u32 = 0u;
const WHITE_OF_EYE: u32 = 1u; // 2 for upper teeth, 3 for lower ones
const RIM: f32 = 0.49; // distance from the middle of the eye's layout for half a turn from the axis

struct Asked {
    eye: Eye,
    part: u32,
    reach_mm: f32, // half of the side of the iris' picture
    ball_mm: f32, // radius of the ball
}

@group(0) @binding(30) var<uniform> asked: Asked;
@group(0) @binding(31) var painted: texture_storage_2d<rgba32float, write>;

fn on_iris(uv: vec2f) -> vec3f {
    return iris_colour(asked.eye, on_iris_at(asked.reach_mm * (2.0 * uv - 1.0)));
}

fn on_white(uv: vec2f) -> vec3f {
    let across = uv - 0.5;
    let angle = min(length(across) / RIM, 1.0) * PI;
    let turn = atan2(-across.y, across.x);
    return white_colour(asked.eye, asked.ball_mm * vec3f(sin(angle) * cos(turn), sin(angle) * sin(turn), cos(angle)));
}

fn on_teeth(uv: vec2f) -> vec3f {
    var point: Point;
    point.uv = uv;
    point.normal = vec3f(0.0, 0.0, 1.0);
    point.dpdu = vec3f(1.0, 0.0, 0.0);
    point.dpdv = vec3f(0.0, 1.0, 0.0);
    return teeth_at(point, f32(asked.part) - 1.0).colour;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(painted);
    if (any(id.xy >= size)) {
        return;
    }
    let uv = (vec2f(id.xy) + 0.5) / vec2f(size);
    var colour = vec3f(0.0);
    switch (asked.part) {
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
    textureStore(painted, id.xy, vec4f(colour, 1.0));
}
