// What the frame knows of the head at places of its surface, rather than of the picture, seen from straight above.
//#include "shading.wgsl"
//#include "each.wgsl"

struct Baking {
    count: u32, // of places
    footprint: f32, // of a texel, a share of the maps' side
    painted: u32, // 1 where the map of roughness, as it was painted, has the pigments beside it
    everywhere: vec2f, // melanin and blood of skin that is alike everywhere
}

//#fill const NUMBERS: u32 = {baked_numbers}u; // of a place

@group(0) @binding(50) var<uniform> baking: Baking;
@group(0) @binding(51) var<storage, read> places: array<vec4u>; // triangle, two weights' bits
@group(0) @binding(52) var<storage, read_write> baked: array<f32>;
@group(0) @binding(53) var thickness_map: texture_2d<f32>; // of the coarse atlas [mm]; 1 where there is surface

fn met_from_above(triangle: u32, weights: vec3f) -> Met {
    let t = triangle_at(triangle);
    var point = interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), weights, t.w);
    point.place = place_of_point(triangle, weights);
    point.curvature = dot(weights, vec3f(curvatures[t.x], curvatures[t.y], curvatures[t.z]));
    var surface: Surface;
    if (is_opaque(point)) {
        surface = Surface(point.normal, shade.material_colour[point.flags >> 8u].rgb, WET_ROUGHNESS, 1.0);
    } else {
        surface = surface_at(point, baking.footprint);
    }
    let open = open_sky(point, t, weights);
    let film = Film(surface.normal, vec3f(0.0));
    let side = f32(textureDimensions(scattered).x);
    let texel = texel_axes(triangle, corner_at(t.x), corner_at(t.y), corner_at(t.z), side);
    var met = Met(point, surface, film, vec3f(1.0), surface.normal, baking.footprint, open, texel);
    if (EYES) {
        made_true(&met);
    }
    return met;
}

// The normal with relief as a map of slopes has it: what `bend` makes of these slopes is that normal again.
fn tangent_normal(point: Point, normal: vec3f) -> vec3f {
    let slope = point.normal - normal / max(dot(normal, point.normal), 1e-3);
    let along = dot(slope, point.dpdu) / max(length(point.dpdu), 1e-6);
    let upward = -dot(slope, point.dpdv) / max(length(point.dpdv), 1e-6);
    return normalize(vec3f(-along, -upward, 1.0));
}

fn pigments_at(point: Point) -> vec2f {
    let mip = mip_for(roughness_map, baking.footprint);
    let painted = textureSampleLevel(roughness_map, map_sampler, point.uv, mip).zw;
    return select(baking.everywhere, painted, baking.painted != 0u);
}

fn thickness_at(point: Point) -> f32 {
    let found = load_bilinear(thickness_map, point.place);
    return select(0.0, found.x / max(found.a, 1e-6), (point.flags & MAPPED) != 0u);
}

fn put_three(at: u32, value: vec3f) {
    baked[at] = value.x;
    baked[at + 1u] = value.y;
    baked[at + 2u] = value.z;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= baking.count) {
        return;
    }
    let place = places[index];
    let second = bitcast<vec2f>(place.yz);
    let met = met_from_above(place.x, vec3f(1.0 - second.x - second.y, second));
    let surface = met.surface;
    let lit = lit_at(met);
    let light = shaded(met, lit);
    let at = NUMBERS * index;
    let pigments = pigments_at(met.point);
    put_three(at, select(shade.total, vec3f(1.0), is_opaque(met.point)) * surface.colour / met.lids);
    put_three(at + 3u, tangent_normal(met.point, surface.normal));
    put_three(at + 6u, lit.entered);
    put_three(at + 9u, PI * (light.below * light.leaving + light.still));
    let u = length(met.point.dpdu);
    let v = length(met.point.dpdv);
    put_three(at + 12u, vec3f(u, v, dot(met.point.dpdu, met.point.dpdv) / max(u * v, 1e-9)));
    put_three(at + 15u, vec3f(surface.roughness, surface.rho_s, 1.0 - enters_from_everywhere(surface.roughness, surface.rho_s)));
    put_three(at + 18u, vec3f(pigments, thickness_at(met.point)));
    baked[at + 21u] = met.point.curvature;
}
