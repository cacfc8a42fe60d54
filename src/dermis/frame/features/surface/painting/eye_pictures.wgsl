// An eyeball as it is seen along its axis, as pictures: colours, and normals of what lies below the film of tears.
//#include "surface/eye_colours.wgsl"

struct Asked {
    eye: Eye,
    rim: f32, // distance from the middle of the layout for half a turn from the axis
    falling: f32, // angle over which that distance grows less and less [rad]
}

@group(0) @binding(0) var<uniform> asked: Asked;
@group(0) @binding(1) var colours: texture_storage_2d<rgba32float, write>;
@group(0) @binding(2) var normals: texture_storage_2d<rgba32float, write>;

const HALF_TURN: f32 = 3.14159265;

// The place of the ball at a distance from the middle of the layout, the way there right and up.
fn place_at(far: f32, way: vec2f) -> vec3f {
    let whole = 1.0 - exp(-HALF_TURN / asked.falling);
    let angle = min(-asked.falling * log(1.0 - min(far / asked.rim, 1.0) * whole), HALF_TURN);
    return eyeball_radius(cos(angle)) * vec3f(sin(angle) * way, cos(angle));
}

// A normal by the axes of the layout, right and up, on a surface with another one.
fn in_layout(normal: vec3f, surface: vec3f, way: vec2f) -> vec3f {
    let outwards = normalize(vec3f(way * surface.z, -length(surface.xy)));
    let around = vec3f(-way.y, way.x, 0.0);
    let right = way.x * outwards - way.y * around;
    let up = way.y * outwards + way.x * around;
    return vec3f(dot(normal, right), dot(normal, up), max(dot(normal, surface), 0.05));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(colours);
    if (any(id.xy >= size)) {
        return;
    }
    let across = ((vec2f(id.xy) + 0.5) / vec2f(size) - 0.5) * vec2f(1.0, -1.0);
    let way = across / max(length(across), 1e-6);
    let p = place_at(length(across), way);
    let clear = clear_at(p);
    let on_iris = on_iris_at(seen_on_iris(p, vec3f(0.0, 0.0, -1.0)));
    let cornea = normalize(p - vec3f(0.0, 0.0, CORNEA_AT));
    let film = normalize(mix(normalize(p), cornea, clear));
    let below = normalize(mix(normalize(p) + vec3f(0.0, 0.0, AROUND), gathered_at(on_iris), clear));
    let colour = mix(white_colour(asked.eye, p), UNDER_WATER * iris_colour(asked.eye, on_iris), clear);
    textureStore(colours, id.xy, vec4f(colour, 1.0));
    textureStore(normals, id.xy, vec4f(normalize(in_layout(below, film, way)), 0.0));
}
