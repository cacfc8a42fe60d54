// Exitance at the sample points of the patches under direct light, and under uniform light.
//#include "irradiance/lighting.wgsl"
//#include "irradiance/subtexel_light.wgsl"
//#include "occlusion/open_sky.wgsl"
//#include "each.wgsl"

const AREA_DEVIATION: f32 = 0.5; // standard deviation of the area over which fine stripes of light are averaged, over the footprint

const WORN_ROUGHNESS: f32 = 0.7; // Beckmann roughness of cloth

struct Samples {
    count: u32,
    footprint: f32, // side of the area that a sample represents, relative to the side of the uv square
    albedo: vec3f, // of the profile
    material_colour: array<vec4f, 64>, // albedo of surfaces that are not skin
}

@group(0) @binding(30) var<uniform> samples: Samples;
@group(0) @binding(31) var<storage, read> sample_points: array<vec2u>; // triangle, packed barycentric weights
@group(0) @binding(32) var<storage, read_write> sample_exitance: array<vec4f>; // exitance by direct light; then exitance in uniform irradiance 1, and the fraction of it that enters the skin

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= samples.count) {
        return;
    }
    let triangle = sample_points[index].x;
    let t = triangle_at(triangle);
    let w2 = unpack2x16unorm(sample_points[index].y);
    let w = vec3f(1.0 - w2.x - w2.y, w2);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    var point = interpolate(a, b, c, w, t.w);
    point.atlas_uv = atlas_position(triangle, w);
    let is_worn = (t.w & OPAQUE) != 0u;
    var surface = surface_at(point, select(samples.footprint * maps_over_atlas(triangle, a, b, c), 0.0, is_worn));
    var albedo = samples.albedo;
    var open = open_at(point.atlas_uv);
    if (is_worn) {
        surface = Surface(point.normal, samples.material_colour[t.w >> 8u].rgb, WORN_ROUGHNESS, 1.0);
        albedo = vec3f(1.0);
        open = open_sky(point, t, w);
    }
    if (STRIPE_LIGHT) {
        let axes = texel_axes(triangle, a, b, c, 1.0 / samples.footprint);
        area_u = AREA_DEVIATION * axes.u;
        area_v = AREA_DEVIATION * axes.v;
    }
    let lit = illuminate(point, surface, point.normal, open);
    let leaving = albedo * surface.colour * leaves_uniform(surface.roughness, surface.rho_s);
    let enters = enters_uniform(surface.roughness, surface.rho_s);
    var uniform_light = vec3f(enters * select(1.0, 1.0 - open, environment.occluded != 0u)); // see entering_from_around
    if (HALF_SPACE) {
        uniform_light *= skin.uniform_reflectance;
    }
    sample_exitance[2u * index] = vec4f(leaving * lit.entered, 0.0);
    sample_exitance[2u * index + 1u] = vec4f(leaving * uniform_light, enters);
}
