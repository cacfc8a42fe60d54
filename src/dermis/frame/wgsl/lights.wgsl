// Lights of every kind: what arrives from each at a point.
//#include "axes.wgsl"
//#include "shadows.wgsl"
//#include "soft_shadows.wgsl"

override SHAPES: bool = false; // whether some light is more than a point, a cone or one direction

const POINT: u32 = 0u;
const SPOT: u32 = 1u;
const DIRECTIONAL: u32 = 2u;
const STRIPE: u32 = 3u;
const RECTANGLE: u32 = 4u;
const SPHERE: u32 = 5u;

struct Light {
    to_map: mat4x4f, // world to the shadow map's clip space
    position: vec3f, // [mm]; in parallel light where the shadow map's middle lies
    kind: u32,
    direction: vec3f, // from the light to its target
    reference_mm: f32, // distance at which `irradiance` holds
    irradiance: vec3f, // on a surface that faces the light there; of rectangles and spheres the radiance
    cos_inner: f32,
    half_u: vec3f, // half sides [mm]; of a stripe the axes over its half sides [1/mm]
    cos_outer: f32,
    half_v: vec3f,
    texel: f32, // side of a shadow texel [mm], for a cone: at 1 mm from the light
    map_right: vec3f, // axes of the shadow map
    map_near: f32, // depth at which it holds 1 [mm]
    map_up: vec3f,
    map_far: f32, // and 0
    extent: vec2f, // half sides on the map [mm], in parallel light tangents; 0 for one point or direction
    softness: f32, // half of the least width of a shadow's edge [mm]
    half_width: u32, // of the shadow filter's tent [shadow texel]
    layer: i32, // in the shadow maps, -1 casts none
    side: u32, // rectangles and spheres are shaded as side x side lights
    lines: u32, // of sight to places on the light, for its shadow
}

struct Lights {
    light: array<Light, 64>,
    place: array<vec4f, 64>, // spread evenly from -1 to 1: xy over a disc, zw over a square
}

@group(0) @binding(11) var<uniform> lights: Lights;
@group(0) @binding(12) var shadow_maps: texture_2d_array<f32>; // depth: 1 near, 0 nothing
@group(0) @binding(25) var shadow_bounds: texture_2d_array<f32>; // nearest depths in squares, see shadow_bounds.wgsl

struct Incident {
    direction: vec3f, // to the light
    irradiance: vec3f, // on a surface that faces it
}

fn is_parallel(light: Light) -> bool {
    return light.kind == DIRECTIONAL || light.kind == STRIPE;
}

// How many directions a light is taken to come from.
fn parts_of(light: Light) -> u32 {
    return select(1u, light.side * light.side, SHAPES && light.kind >= RECTANGLE);
}

fn incident(light: Light, p: vec3f, part: u32) -> Incident {
    if (light.kind == DIRECTIONAL) {
        return Incident(-light.direction, light.irradiance);
    }
    if (SHAPES && light.kind >= STRIPE) {
        return from_shape(light, p, part);
    }
    let d = light.position - p;
    let d2 = max(dot(d, d), 1.0);
    let l = d * inverseSqrt(d2);
    var e = light.irradiance * light.reference_mm * light.reference_mm / d2;
    if (light.kind == SPOT) {
        e *= smoothstep(light.cos_outer, light.cos_inner, dot(-l, light.direction));
    }
    return Incident(l, e);
}

fn from_shape(light: Light, p: vec3f, part: u32) -> Incident {
    if (light.kind == STRIPE) {
        return Incident(-light.direction, light.irradiance * stripe(light, p));
    }
    if (light.kind == RECTANGLE) {
        return from_rectangle(light, p, part);
    }
    return from_sphere(light, p, part);
}

// A Gaussian across the sheet, 1/e^2 at its edges; even along it.
fn stripe(light: Light, p: vec3f) -> f32 {
    let d = p - light.position;
    let across = dot(d, light.half_u);
    return exp(-2.0 * across * across) * (1.0 - smoothstep(0.95, 1.0, abs(dot(d, light.half_v))));
}

// Middle of a part in the square from -1 to 1.
fn place_of(part: u32, side: u32) -> vec2f {
    return (2.0 * vec2f(vec2u(part % side, part / side)) + 1.0) / f32(side) - 1.0;
}

fn from_rectangle(light: Light, p: vec3f, part: u32) -> Incident {
    let place = place_of(part, light.side);
    let d = light.position + place.x * light.half_u + place.y * light.half_v - p;
    let d2 = max(dot(d, d), 1.0);
    let l = d * inverseSqrt(d2);
    let area = 4.0 * length(light.half_u) * length(light.half_v) / f32(parts_of(light));
    return Incident(l, light.irradiance * max(0.0, -dot(l, light.direction)) * area / d2);
}

// Parts of the cone that the sphere fills, equal as seen from its foot, the square laid on its disc [ShirleyChiu1997]:
// together they light any surface that sees all of the sphere as much as the sphere does.
fn from_sphere(light: Light, p: vec3f, part: u32) -> Incident {
    let d = light.position - p;
    let sine2 = clamp(dot(light.half_u, light.half_u) / max(dot(d, d), 1e-6), 0.0, 1.0);
    let place = place_of(part, light.side);
    let steep = abs(place.x) <= abs(place.y);
    let r = select(place.x, place.y, steep);
    let turn = 0.25 * PI * select(place.y / place.x, place.x / place.y, steep);
    let phi = select(turn, 0.5 * PI - turn, steep);
    let sine = r * sqrt(sine2);
    let cosine = sqrt(1.0 - sine * sine);
    let w = normalize(d);
    let axes = beside(w);
    let l = sine * (cos(phi) * axes[0] + sin(phi) * axes[1]) + cosine * w;
    return Incident(l, light.irradiance * (PI * sine2 / (cosine * f32(parts_of(light)))));
}
