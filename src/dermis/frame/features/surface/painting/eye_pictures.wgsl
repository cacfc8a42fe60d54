// Pictures of an eyeball seen along its axis: colours, and normals of the surface below the tear film.
//#include "surface/eye_colours.wgsl"
//#include "irradiance/below_cornea.wgsl"

struct EyePicture {
    eye: Eye,
    rim: f32, // distance from the centre of the layout that corresponds to the back of the eyeball
    falling: f32, // constant of the exponential by which the distance depends on the angle [rad]
}

@group(0) @binding(0) var<uniform> picture: EyePicture;
@group(0) @binding(1) var colours: texture_storage_2d<rgba32float, write>;
@group(0) @binding(2) var normals: texture_storage_2d<rgba32float, write>;

const HALF_TURN: f32 = 3.14159265;
const LIGHT_ANGLE: f32 = 0.6; // between the axis and the lights for which the light on the iris is exact [rad]

// Point of the eyeball at a radius and in a direction (right, up) from the centre of the layout.
fn point_at(radius: f32, direction: vec2f) -> vec3f {
    let limit = 1.0 - exp(-HALF_TURN / picture.falling);
    let angle = min(-picture.falling * log(1.0 - min(radius / picture.rim, 1.0) * limit), HALF_TURN);
    return eyeball_radius(cos(angle)) * vec3f(sin(angle) * direction, cos(angle));
}

// A normal in the tangent frame of the layout (right, up), on a surface with another normal.
fn in_layout(normal: vec3f, surface: vec3f, direction: vec2f) -> vec3f {
    let outwards = normalize(vec3f(direction * surface.z, -length(surface.xy)));
    let around = vec3f(-direction.y, direction.x, 0.0);
    let right = direction.x * outwards - direction.y * around;
    let up = direction.y * outwards + direction.x * around;
    return vec3f(dot(normal, right), dot(normal, up), max(dot(normal, surface), 0.05));
}

// Vector in the space of the eye whose product with the direction to a light is the irradiance of the iris relative to that on its axis. It is
// exact for two lights, on the side of the point and on the opposite side.
fn iris_light(on_iris: vec2f) -> vec3f {
    let radius = length(on_iris) / IRIS_MM;
    let sine = sin(LIGHT_ANGLE);
    let cosine = cos(LIGHT_ANGLE);
    let near = iris_irradiance(radius * radius, radius * sine, cosine);
    let opposite = iris_irradiance(radius * radius, -radius * sine, cosine);
    let outwards = on_iris / max(length(on_iris), 1e-3);
    return vec3f(0.5 * (near - opposite) / sine * outwards, 0.5 * (near + opposite) / cosine) / iris_irradiance(0.0, 0.0, 1.0);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(colours);
    if (any(id.xy >= size)) {
        return;
    }
    let across = ((vec2f(id.xy) + 0.5) / vec2f(size) - 0.5) * vec2f(1.0, -1.0);
    let direction = across / max(length(across), 1e-6);
    let p = point_at(length(across), direction);
    let clear = clearness(p);
    let on_iris = clamped_to_iris(refracted_to_iris(p, vec3f(0.0, 0.0, -1.0)));
    let cornea = normalize(p - vec3f(0.0, 0.0, CORNEA_AT));
    let film = normalize(mix(normalize(p), cornea, clear));
    let light = iris_light(on_iris);
    let below = normalize(mix(normalize(p), normalize(light), clear));
    let colour = mix(white_colour(picture.eye, p), IRIS_FACTOR * length(light) * iris_colour(picture.eye, on_iris), clear);
    textureStore(colours, id.xy, vec4f(colour, 1.0));
    textureStore(normals, id.xy, vec4f(normalize(in_layout(below, film, direction)), 0.0));
}
