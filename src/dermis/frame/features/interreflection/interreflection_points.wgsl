// Light that leaves places of the skin's patches, and which share of more light would.
//#include "irradiance/lighting.wgsl"
//#include "irradiance/fine_light.wgsl"
//#include "each.wgsl"

const SPREAD: f32 = 0.5; // standard deviation over which light that is finer is averaged, over the footprint

struct Leaving {
    places: u32,
    footprint: f32, // side of what a place stands for, over that of the uv square
    albedo: vec3f, // of the profile
}

@group(0) @binding(30) var<uniform> leaving: Leaving;
@group(0) @binding(31) var<storage, read> places: array<vec2u>; // triangle, its packed weights
@group(0) @binding(32) var<storage, read_write> emitted: array<vec4f>; // radiant exitance; then that of 1 from everywhere, and how much of it enters

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= leaving.places) {
        return;
    }
    let triangle = places[index].x;
    let t = triangle_at(triangle);
    let w2 = unpack2x16unorm(places[index].y);
    let w = vec3f(1.0 - w2.x - w2.y, w2);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    var point = interpolate(a, b, c, w, t.w);
    point.place = place_of_point(triangle, w);
    let surface = surface_at(point, leaving.footprint * maps_over_atlas(triangle, a, b, c));
    if (STRIPE_LIGHT) {
        let axes = texel_axes(triangle, a, b, c, 1.0 / leaving.footprint);
        area_u = SPREAD * axes.u;
        area_v = SPREAD * axes.v;
    }
    let open = open_at(point.place);
    let lit = light_up(point, surface, point.normal, open);
    let out = leaving.albedo * surface.colour * leaves_everywhere(surface.roughness, surface.rho_s);
    let enters = enters_from_everywhere(surface.roughness, surface.rho_s);
    var around = vec3f(enters * select(1.0, 1.0 - open, environment.occluded != 0u)); // as entering_from_around has it
    if (HALF_SPACE) {
        around *= skin.back_from_everywhere;
    }
    emitted[2u * index] = vec4f(out * lit.entered, 0.0);
    emitted[2u * index + 1u] = vec4f(out * around, enters);
}
