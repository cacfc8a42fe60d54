// Lights of all kinds, and the light that arrives from each at a point.
//#include "axes.wgsl"
//#include "shadows/shadows.wgsl"
//#include "shadows/soft_shadows.wgsl"
//#include <lights>

override SHAPES: bool = false; // whether there are area lights

// Whether the scene has lights of each kind; optional kinds are compiled only if it has.
//#each lights: override {override}: bool = {always};

struct Light {
    to_map: mat4x4f, // world to the shadow map's clip space
    position: vec3f, // [mm]; in parallel light the centre of the shadow map
    kind: u32,
    direction: vec3f, // from the light to its target
    reference_mm: f32, // distance at which `irradiance` holds
    irradiance: vec3f, // on a surface that faces the light at that distance; of area lights the radiance
    cos_inner: f32,
    half_u: vec3f, // half sides [mm]; of a stripe the axes divided by its half sides [1/mm]
    cos_outer: f32,
    half_v: vec3f,
    texel: f32, // side of a shadow texel [mm]; in maps with perspective, of one at a distance of 1 mm from the light
    map_right: vec3f, // axes of the shadow map
    map_near: f32, // depth at which the map stores 1 [mm]
    map_up: vec3f,
    map_far: f32, // depth at which it stores 0 [mm]
    extent: vec2f, // half sides on the map [mm], in parallel light tangents; 0 for punctual lights
    softness: f32, // half of the least width of the edge of a shadow [mm]
    half_width: u32, // of the tent of the shadow filter [shadow texels]
    layer: i32, // in the shadow maps, -1 without shadows
    side: u32, // an area light is sampled by side x side points
    rays: u32, // number of shadow rays
    parallel: u32, // 1 for parallel light, whose map has no perspective
    round: u32, // 1 for a disc on its map, 0 for a rectangle
    punctual: u32, // 1 if all light comes from one position or, in parallel light, from one direction
    sheet: u32, // 1 if irradiance is a Gaussian along half_u, so that blurs of it are exact
}

struct Lights {
    //#fill light: array<Light, {max_lights}>,
    //#fill sample_points: array<vec4f, {max_rays}>, // even distributions from -1 to 1: xy over a disc, zw over a square
}

@group(0) @binding(11) var<uniform> lights: Lights;
@group(0) @binding(12) var shadow_maps: texture_2d_array<f32>; // depth: 1 near, 0 empty
@group(0) @binding(25) var shadow_bounds: texture_2d_array<f32>; // nearest depths in squares, see shadow_bounds.wgsl

// Standard deviations of the area over which light is averaged, along two directions [mm]; 0 samples a point.
var<private> area_u: vec3f;
var<private> area_v: vec3f;

// Variance of the area along an axis [mm^2 times the square of the length of the axis].
fn area_variance(axis: vec3f) -> f32 {
    let u = dot(area_u, axis);
    let v = dot(area_v, axis);
    return u * u + v * v;
}

struct Incident {
    direction: vec3f, // to the light
    irradiance: vec3f, // on a surface that faces it
}

fn is_parallel(light: Light) -> bool {
    return light.parallel != 0u;
}

// Direction to the centre of a light.
fn towards_light(light: Light, p: vec3f) -> vec3f {
    if (is_parallel(light)) {
        return -light.direction;
    }
    return normalize(light.position - p);
}

// Number of directions in which a light is sampled.
fn parts_of(light: Light) -> u32 {
    return select(1u, light.side * light.side, SHAPES);
}

// Centre of a part in the square from -1 to 1.
fn part_centre(part: u32, side: u32) -> vec2f {
    return (2.0 * vec2f(vec2u(part % side, part / side)) + 1.0) / f32(side) - 1.0;
}

// Incident light from a part of a light.
fn incident(light: Light, p: vec3f, part: u32) -> Incident {
    //#each lights: if ({override} && light.kind == {number}) { return {name}_incident(light, p, part); }
    return Incident(vec3f(0.0), vec3f(0.0));
}
