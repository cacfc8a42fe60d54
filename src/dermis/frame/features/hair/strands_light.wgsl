// Light that knots of hairs scatter towards the eye, and where they are in the picture. Light that other hairs have scattered
// arrives from all around the light's direction, and from the hair below [Zinke2008].
//#include "each.wgsl"
//#include "irradiance/lighting.wgsl"
//#include "hair.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_view.wgsl"

const LIFT_MM: f32 = 0.4; // off the skin, for shadow rays
const HORIZON: f32 = 0.2; // cosine by which the skin's horizon is soft
const LOWERED: f32 = 0.3; // and by which it is lower a millimetre over the skin
const BLURRED: f32 = 0.7; // roughness at which hairs see their surroundings
const SKY_FROM: f32 = 0.5; // cosine below and above the skin's horizon between which skin gives way to sky
const LOCAL: f32 = 0.7; // of light that hairs behind send back, as published
const WIDE_VARIANCE: f32 = 0.3; // along the fibre, of light that other hairs have scattered
const HEAD_MM: f32 = 85.0; // radius
const BEYOND_HORIZON: f32 = 0.15; // cosine, to be sure
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
    above: f32, // what hair farther from the skin covers
    below: f32, // and what hair nearer to it does
}

fn knot_at(hair: u32, k: u32) -> Knot {
    let row = row_of_hair(hair);
    let first = row + ROWS_BEFORE;
    let here = posed[first + k];
    let along = normalize(posed[first + min(k + 1u, knots_of(hair) - 1u)].xyz - posed[first + max(k, 1u) - 1u].xyz);
    let depth = posed[row + 1u].xyz * here.w;
    let height = dot(here.xyz - posed[first].xyz, posed[row].xyz);
    let cover = posed[row + 1u].w;
    let risen = f32(k) / f32(knots_of(hair) - 1u);
    let eye = normalize(strand_view.eye - here.xyz);
    return Knot(here.xyz, posed[row].xyz, along, eye, depth, height, cover * (1.0 - risen), cover * risen);
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
    return risen(knot, l) * visibility(light, point, l);
}

// Mean radiance about a direction: of the sky through hair above, and of what lies below the skin's horizon.
fn around_hair(direction: vec3f, knot: Knot, below: vec3f, through: vec3f) -> vec3f {
    let up = smoothstep(-SKY_FROM, SKY_FROM, dot(direction, knot.normal));
    if (!ENVIRONMENT) {
        return (1.0 - up) * below;
    }
    return mix(below, through * reflection(direction, BLURRED), up);
}

// Share of light from the front that hairs behind a hair send back. Source: [Zinke2008] equations 14 to 16.
// forth, back: what a hair scatters away from the light and towards it
fn sent_back(forth: vec3f, back: vec3f) -> vec3f {
    let twice = forth * forth;
    let rest = 1.0 - min(twice, vec3f(0.95));
    return back * twice / rest + back * back * back * twice / (rest * rest * rest);
}

// Share of light that hair without end sends back, by what one hair does.
fn hair_returns(albedo: vec3f) -> vec3f {
    let root = sqrt(max(1.0 - albedo, vec3f(0.0)));
    return (1.0 - root) / (1.0 + root);
}

fn radiance_of(knot: Knot) -> vec3f {
    let sin_o = dot(knot.eye, knot.along);
    let side = across_fibre(knot.eye, knot.along);
    let share = hair_albedo(sin_o, knot.depth);
    let forth = share.passed + 0.5 * share.rest;
    let back = share.reflected + share.inside + 0.5 * share.rest;
    let dense = 1.0 - exp(-knot.below);
    let returned = LOCAL * dense * sent_back(forth, back);
    var total = vec3f(0.0);
    var arrived = vec3f(0.0);
    for (var i = 0u; i < skin.light_count; i += 1u) {
        let light = lights.light[i];
        let from_light = arriving(light, knot.position);
        let l = from_light.direction;
        let e = from_light.irradiance * seen_of(light, knot, l);
        let cover = strands_before(light, knot.position);
        let direct = exp(-cover);
        let phi = acos(clamp(dot(across_fibre(l, knot.along), side), -1.0, 1.0));
        total += e * direct * hair_scattered(dot(l, knot.along), sin_o, phi, knot.depth);
        let scattered = exp(-cover * (1.0 - forth)) - direct;
        let wide = 0.5 / HAIR_PI * hair_along(dot(l, knot.along), sin_o, WIDE_VARIANCE);
        total += e * wide * (scattered * (forth + back) + (direct + scattered) * 2.0 * returned);
        arrived += e * (direct + scattered) * max(dot(l, knot.normal), 0.0);
    }
    let through = exp(-knot.above * (1.0 - forth - back));
    if (ENVIRONMENT) {
        arrived += through * panorama_at(knot.normal, 0u);
    }
    let below = arrived / PI * mix(strand_view.skin, hair_returns(forth + back), dense);
    let cone = sqrt(max(1.0 - sin_o * sin_o, 0.0)) * side;
    let behind = around_hair(cone - sin_o * knot.along, knot, below, through);
    let ahead = around_hair(-cone - sin_o * knot.along, knot, below, through);
    total += (share.reflected + share.inside) * behind + share.passed * ahead;
    return total + share.rest * 0.5 * (behind + ahead);
}

// Whether the head is in front of all of a coarse hair: it stands beyond the horizon by more than it is long.
fn is_hidden(hair: u32) -> bool {
    if (!is_coarse(hair)) {
        return false;
    }
    let row = row_of_hair(hair);
    let root = posed[row + ROWS_BEFORE].xyz;
    let reach = distance(posed[row + ROWS_BEFORE + hairs.coarse_knots - 1u].xyz, root);
    return dot(posed[row].xyz, normalize(strand_view.eye - root)) < -(BEYOND_HORIZON + sqrt(2.0 * reach / HEAD_MM));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= all_knots(strand_view.coarse)) {
        return;
    }
    let hair = hair_of_knot(index);
    let here = posed[row_of_knot(index, hair)];
    var seen = seen_at(here.xyz, here.w);
    seen.width *= select(1.0, strand_view.wider, is_coarse(hair));
    if (is_hidden(hair)) {
        seen.width = -1.0;
    }
    let inside = all(seen.place > vec2f(-BEYOND)) && all(seen.place < strand_view.size + BEYOND);
    if (inside && seen.width >= 0.0) {
        seen.radiance = strand_view.shown.y * radiance_of(knot_at(hair, index - first_knot(hair)));
    }
    drawn[index] = seen;
}
