// Light that knots of hairs scatter towards the eye, and where they are in the picture.
//#include "each.wgsl"
//#include "lighting.wgsl"
//#include "hair.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_view.wgsl"

const LIFT_MM: f32 = 0.4; // off the skin, for shadow rays
const HORIZON: f32 = 0.2; // cosine by which the skin's horizon is soft
const LOWERED: f32 = 0.3; // and by which it is lower a millimetre over the skin
const BLURRED: f32 = 0.7; // roughness at which hairs see their surroundings
const SKY_FROM: f32 = 0.5; // cosine below and above the skin's horizon between which skin gives way to sky
const BEYOND: f32 = 64.0; // pixels outside the picture from which on knots are not lit

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> drawn: array<Drawn>;

// A knot and what is seen from it.
struct Knot {
    position: vec3f,
    normal: vec3f, // of the skin at the root
    along: vec3f, // to the tip
    eye: vec3f, // unit
    depth: vec3f, // absorption over a radius
    height: f32, // over the skin at the root [mm]
}

fn knot_at(strand: u32, k: u32) -> Knot {
    let row = strand * rows_of_strand();
    let first = row + KNOTS_FROM;
    let here = posed[first + k];
    let along = normalize(posed[first + min(k + 1u, KNOTS - 1u)].xyz - posed[first + max(k, 1u) - 1u].xyz);
    let depth = posed[row + 1u].xyz * here.w;
    let height = dot(here.xyz - posed[first].xyz, posed[row].xyz);
    return Knot(here.xyz, posed[row].xyz, along, normalize(strand_view.eye - here.xyz), depth, height);
}

// A direction's part across a fibre, unit.
fn across_fibre(direction: vec3f, along: vec3f) -> vec3f {
    let part = direction - dot(direction, along) * along;
    return part / max(length(part), 1e-4);
}

// Irradiance that faces a light and its mean direction; lights of some size count as one for a fibre's wide lobes.
fn arriving(light: Light, p: vec3f) -> Incident {
    var sum = Incident(vec3f(0.0), vec3f(0.0));
    for (var part = 0u; part < parts_of(light); part += 1u) {
        let one = incident(light, p, part);
        sum.irradiance += one.irradiance;
        sum.direction += one.direction * dot(one.irradiance, vec3f(1.0));
    }
    sum.direction /= max(length(sum.direction), 1e-20);
    return sum;
}

// Share of a light over the skin's horizon, which a knot sees beyond by its height; shadow maps are too coarse to tell.
fn risen(knot: Knot, l: vec3f) -> f32 {
    return smoothstep(-HORIZON - LOWERED * max(knot.height, 0.0), HORIZON, dot(knot.normal, l));
}

fn seen_of(light: Light, knot: Knot, l: vec3f) -> f32 {
    var point: Point;
    point.position = knot.position;
    point.lit_position = knot.position + LIFT_MM * knot.normal;
    point.normal = select(knot.normal, l, light.narrow == 0u); // a hair has no horizon
    return risen(knot, l) * visibility(light, point, l) * past_strands(light, knot.position);
}

// Mean radiance about a direction: of the sky, and of the skin below its horizon.
fn around_hair(direction: vec3f, knot: Knot, skin_radiance: vec3f) -> vec3f {
    let up = smoothstep(-SKY_FROM, SKY_FROM, dot(direction, knot.normal));
    if (!ENVIRONMENT) {
        return (1.0 - up) * skin_radiance;
    }
    return mix(skin_radiance, reflection(direction, BLURRED), up);
}

fn radiance_of(knot: Knot) -> vec3f {
    let sin_o = dot(knot.eye, knot.along);
    let side = across_fibre(knot.eye, knot.along);
    var total = vec3f(0.0);
    var on_skin = vec3f(0.0);
    for (var i = 0u; i < skin.light_count; i += 1u) {
        let light = lights.light[i];
        let from_light = arriving(light, knot.position);
        let l = from_light.direction;
        let e = from_light.irradiance * seen_of(light, knot, l);
        let phi = acos(clamp(dot(across_fibre(l, knot.along), side), -1.0, 1.0));
        total += e * hair_scattered(dot(l, knot.along), sin_o, phi, knot.depth);
        on_skin += e * max(dot(l, knot.normal), 0.0);
    }
    if (ENVIRONMENT) {
        on_skin += panorama_at(knot.normal, 0u);
    }
    let skin_radiance = strand_view.skin * on_skin / PI;
    let share = hair_albedo(sin_o, knot.depth);
    let cone = sqrt(max(1.0 - sin_o * sin_o, 0.0)) * side;
    let back = around_hair(cone - sin_o * knot.along, knot, skin_radiance);
    let forth = around_hair(-cone - sin_o * knot.along, knot, skin_radiance);
    total += (share.reflected + share.inside) * back + share.passed * forth;
    return total + share.rest * 0.5 * (back + forth);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= strand_view.hairs * KNOTS) {
        return;
    }
    let strand = index / KNOTS;
    let k = index % KNOTS;
    let here = posed[strand * rows_of_strand() + KNOTS_FROM + k];
    var seen = seen_at(here.xyz, here.w);
    let inside = all(seen.place > vec2f(-BEYOND)) && all(seen.place < strand_view.size + BEYOND);
    if (inside && seen.width >= 0.0) {
        seen.radiance = strand_view.shown.y * radiance_of(knot_at(strand, k));
    }
    drawn[index] = seen;
}
