// Properties and light at points of the surface, seen along the normal, instead of at pixels of the picture.
//#include "shading.wgsl"
//#include "each.wgsl"

struct Baking {
    count: u32, // number of points
    footprint: f32, // side of a texel relative to the side of the maps
    painted: u32, // 1 if the painted map of roughness also holds the pigments
    uniform_pigments: vec2f, // melanin and blood of uniform skin
}

//#fill const NUMBERS: u32 = {baked_numbers}u; // per point

@group(0) @binding(50) var<uniform> baking: Baking;
@group(0) @binding(51) var<storage, read> points: array<vec4u>; // triangle, bits of two barycentric weights
@group(0) @binding(52) var<storage, read_write> baked: array<f32>;
@group(0) @binding(53) var thickness_map: texture_2d<f32>; // of the coarse atlas [mm]; 1 where there is surface

fn shading_point_from_above(triangle: u32, weights: vec3f) -> ShadingPoint {
    let t = triangle_at(triangle);
    var point = interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), weights, t.w);
    point.atlas_uv = atlas_position(triangle, weights);
    point.curvature = dot(weights, vec3f(curvatures[t.x], curvatures[t.y], curvatures[t.z]));
    let part = surface_or_part(point, baking.footprint);
    let surface = part.surface;
    let open = open_sky(point, t, weights);
    let film = plain_film(surface.normal, vec3f(0.0));
    let side = f32(textureDimensions(scattered).x);
    let texel = texel_axes(triangle, corner_at(t.x), corner_at(t.y), corner_at(t.z), side);
    var shading_point = ShadingPoint(point, surface, film, surface.normal, baking.footprint, open, texel, part.metalness, part.emission, part.sheen);
    if (EYES) {
        apply_modelled_parts(&shading_point);
    }
    return shading_point;
}

// Normal with relief in tangent space: the inverse of `bend`.
fn tangent_normal(point: Point, normal: vec3f) -> vec3f {
    let slope = point.normal - normal / max(dot(normal, point.normal), 1e-3);
    let slope_u = dot(slope, point.dpdu) / max(length(point.dpdu), 1e-6);
    let slope_v = -dot(slope, point.dpdv) / max(length(point.dpdv), 1e-6);
    return normalize(vec3f(-slope_u, -slope_v, 1.0));
}

fn pigments_at(point: Point) -> vec2f {
    let mip = mip_for(roughness_map, baking.footprint);
    let painted = textureSampleLevel(roughness_map, map_sampler, point.uv, mip).zw;
    return select(baking.uniform_pigments, painted, baking.painted != 0u);
}

fn thickness_at(point: Point) -> f32 {
    let thickness = load_bilinear(thickness_map, point.atlas_uv);
    return select(0.0, thickness.x / max(thickness.a, 1e-6), (point.flags & MAPPED) != 0u);
}

fn store_vec3(first: u32, value: vec3f) {
    baked[first] = value.x;
    baked[first + 1u] = value.y;
    baked[first + 2u] = value.z;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= baking.count) {
        return;
    }
    let words = points[index];
    let weights_bc = bitcast<vec2f>(words.yz);
    let shading_point = shading_point_from_above(words.x, vec3f(1.0 - weights_bc.x - weights_bc.y, weights_bc));
    let surface = shading_point.surface;
    let lit = lit_at(shading_point);
    let shaded_point = shaded(shading_point, lit);
    let first = NUMBERS * index;
    let pigments = pigments_at(shading_point.point);
    store_vec3(first, select(shade.total, vec3f(1.0), is_opaque(shading_point.point)) * surface.colour);
    store_vec3(first + 3u, tangent_normal(shading_point.point, surface.normal));
    store_vec3(first + 6u, lit.entered);
    store_vec3(first + 9u, PI * (shaded_point.below * shaded_point.leaving + shaded_point.local));
    let u = length(shading_point.point.dpdu);
    let v = length(shading_point.point.dpdv);
    store_vec3(first + 12u, vec3f(u, v, dot(shading_point.point.dpdu, shading_point.point.dpdv) / max(u * v, 1e-9)));
    store_vec3(first + 15u, vec3f(surface.roughness, surface.rho_s, 1.0 - enters_uniform(surface.roughness, surface.rho_s)));
    store_vec3(first + 18u, vec3f(pigments, thickness_at(shading_point.point)));
    baked[first + 21u] = shading_point.point.curvature;
}
