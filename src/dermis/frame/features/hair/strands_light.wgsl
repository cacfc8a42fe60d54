// Radiance of each knot towards the eye by dual scattering, and the position of the knot in the picture. Light scattered by
// other strands arrives from directions near that of the light, and from the hair behind [Zinke2008].
//#include "each.wgsl"
//#include "irradiance/lighting.wgsl"
//#include "hair.wgsl"
//#include "strand_knots.wgsl"
//#include "strand_view.wgsl"

const SURFACE_OFFSET_MM: f32 = 0.4; // offset of shadow rays from the skin
const HORIZON_WIDTH: f32 = 0.2; // half-width of the soft horizon of the skin, as a cosine
const HORIZON_DROP: f32 = 0.3; // amount by which the horizon sinks per millimetre of height above the skin, as a cosine
const REFLECTION_ROUGHNESS: f32 = 0.7; // roughness of the reflection of the environment by strands
// Fractions of the lobes R, TT and TRT by azimuth: in the quadrant of the eye, beside it on both sides, and opposite to it.
const REFLECTED_AROUND: vec3f = vec3f(0.235, 0.48, 0.285);
const TRANSMITTED_AROUND: vec3f = vec3f(0.0, 0.275, 0.725);
const INTERNAL_AROUND: vec3f = vec3f(0.865, 0.135, 0.0);
const SKY_WIDTH: f32 = 0.5; // half-width of the transition from skin to sky at the horizon, as a cosine
const BACKSCATTER_DENSITY: f32 = 0.7; // density factor of backscattering by the strands behind, as published
const WIDE_VARIANCE: f32 = 0.3; // longitudinal variance of light that other strands have scattered
const HORIZON_REACH_MM: vec2f = vec2f(8.0, 30.0); // distances from the root between which the horizon of the skin fades
const PICTURE_MARGIN: f32 = 64.0; // distance outside the picture beyond which knots are not shaded [pixel]

override STRIDE: u32 = 1u; // one of this many knots of a coarse strand is shaded, see strands_spread.wgsl

@group(0) @binding(30) var<storage, read> posed: array<vec4f>;
@group(0) @binding(31) var<storage, read_write> projected: array<ProjectedKnot>;

// A knot and its surroundings.
struct Knot {
    position: vec3f,
    normal: vec3f, // of the skin at the root
    along: vec3f, // tangent towards the tip
    eye: vec3f, // unit
    depth: vec3f, // optical depth of a radius
    height: f32, // above the skin at the root [mm]
    from_root: f32, // distance [mm]
    below: f32, // cover by hair nearer to the skin
}

fn knot_at(hair: u32, k: u32) -> Knot {
    let row = row_of_hair(hair);
    let first = row + ROWS_BEFORE;
    let here = posed[first + k];
    let along = normalize(posed[first + min(k + 1u, knots_of(hair) - 1u)].xyz - posed[first + max(k, 1u) - 1u].xyz);
    let along_strand = f32(k) / f32(knots_of(hair) - 1u);
    let packed = posed[row + 1u].w;
    let undyed = fract(packed);
    let absorption = select(posed[row + 1u].xyz, hairs.dye, undyed > 0.0 && along_strand > undyed);
    let depth = absorption * select(here.w, posed[row].w, posed[row].w > 0.0);
    let height = dot(here.xyz - posed[first].xyz, posed[row].xyz);
    let cover = floor(packed) / COVER_STEPS;
    let eye = normalize(strand_view.eye - here.xyz);
    return Knot(here.xyz, posed[row].xyz, along, eye, depth, height, distance(here.xyz, posed[first].xyz), cover * along_strand);
}

// Component of a direction across a fibre, as a unit vector.
fn across_fibre(direction: vec3f, along: vec3f) -> vec3f {
    let part = direction - dot(direction, along) * along;
    return part / max(length(part), 1e-4);
}

// Irradiance by all parts of a light on a surface that faces it, and its mean direction: the lobes of a fibre are wide.
fn incident_light(light: Light, p: vec3f) -> Incident {
    var sum = Incident(vec3f(0.0), vec3f(0.0));
    for (var part = 0u; part < parts_of(light); part += 1u) {
        let one = incident(light, p, part);
        sum.irradiance += one.irradiance;
        sum.direction += one.direction * dot(one.irradiance, vec3f(1.0));
    }
    sum.direction /= max(length(sum.direction), 1e-20);
    return sum;
}

// Fraction of a light above the horizon of the skin, which is lower for a higher knot; shadow maps are too coarse for this. Far from
// the root, the skin there says nothing about the light, and only shadow maps count.
fn above_horizon(knot: Knot, l: vec3f) -> f32 {
    let above = smoothstep(-HORIZON_WIDTH - HORIZON_DROP * max(knot.height, 0.0), HORIZON_WIDTH, dot(knot.normal, l));
    return mix(above, 1.0, smoothstep(HORIZON_REACH_MM.x, HORIZON_REACH_MM.y, knot.from_root));
}

fn light_visibility(light: Light, knot: Knot, l: vec3f) -> f32 {
    var point: Point;
    point.position = knot.position;
    point.lit_position = knot.position + SURFACE_OFFSET_MM * knot.normal;
    point.normal = select(knot.normal, l, light.punctual == 0u || knot.from_root > HORIZON_REACH_MM.x); // a strand has no horizon
    return above_horizon(knot, l) * visibility(light, point, l);
}

// Fraction of diffuse light that passes through hair, by colour. passing: the same for the mean of all colours
fn tinted(passing: f32, absorbed: vec3f) -> vec3f {
    return pow(vec3f(clamp(passing, 1e-6, 1.0)), absorbed / max(hairs.absorptance, 1e-3));
}

// Mean radiance around a direction: of the sky through other hair, and of the skin. sky: transmittances at the knot; below:
// radiance of the skin; absorbed: fraction of light that a hair absorbs
fn environment_around(direction: vec3f, knot: Knot, sky: SkyTransmittance, below: vec3f, absorbed: vec3f) -> vec3f {
    let up = smoothstep(-SKY_WIDTH, SKY_WIDTH, dot(direction, knot.normal));
    if (!ENVIRONMENT) {
        return (1.0 - up) * below;
    }
    let past_hair = saturate(sky.hair.w + dot(sky.hair.xyz, direction));
    let past_all = saturate(sky.all.w + dot(sky.all.xyz, direction));
    // near its root, the skin around a strand hides the sky below the horizon: cells are too coarse for this
    let horizon = mix(up, 1.0, smoothstep(HORIZON_REACH_MM.x, HORIZON_REACH_MM.y, knot.from_root));
    let open = horizon * min(past_all / max(past_hair, 1e-4), 1.0);
    let seen = mix(below, reflection(direction, REFLECTION_ROUGHNESS), open);
    return tinted(past_hair, absorbed) * seen;
}

// Fraction of light that the strands behind a strand scatter back. Source: [Zinke2008] equations 14 to 16.
// forth, back: fractions that a strand scatters forward and backward
fn backscattered(forth: vec3f, back: vec3f) -> vec3f {
    let twice = forth * forth;
    let rest = 1.0 - min(twice, vec3f(0.95));
    return back * twice / rest + back * back * back * twice / (rest * rest * rest);
}

// Reflectance of an infinitely dense layer of hair, by the albedo of a strand.
fn dense_hair_reflectance(albedo: vec3f) -> vec3f {
    let root = sqrt(max(1.0 - albedo, vec3f(0.0)));
    return (1.0 - root) / (1.0 + root);
}

fn radiance_of(knot: Knot) -> vec3f {
    let sin_o = dot(knot.eye, knot.along);
    let side = across_fibre(knot.eye, knot.along);
    let albedo = hair_albedo(sin_o, knot.depth);
    let forth = albedo.transmitted + 0.5 * albedo.residual;
    let back = albedo.reflected + albedo.internal + 0.5 * albedo.residual;
    let dense = 1.0 - exp(-knot.below);
    let returned = BACKSCATTER_DENSITY * dense * backscattered(forth, back);
    var total = vec3f(0.0);
    var skin_irradiance = vec3f(0.0);
    for (var i = 0u; i < skin.light_count; i += 1u) {
        let light = lights.light[i];
        let from_light = incident_light(light, knot.position);
        let l = from_light.direction;
        let e = from_light.irradiance * light_visibility(light, knot, l);
        let cover = strand_cover(light, knot.position);
        let direct = exp(-cover);
        let phi = acos(clamp(dot(across_fibre(l, knot.along), side), -1.0, 1.0));
        total += e * direct * hair_scattered(dot(l, knot.along), sin_o, phi, knot.depth);
        let scattered = exp(-cover * (1.0 - forth)) - direct;
        let wide = 0.5 / HAIR_PI * hair_longitudinal(dot(l, knot.along), sin_o, WIDE_VARIANCE);
        total += e * wide * (scattered * (forth + back) + (direct + scattered) * 2.0 * returned);
        skin_irradiance += e * (direct + scattered) * max(dot(l, knot.normal), 0.0);
    }
    let absorbed = 1.0 - forth - back;
    var sky = SkyTransmittance(vec4f(0.0), vec4f(0.0));
    if (ENVIRONMENT) {
        // visible strands are on top of the hair in their cell
        let grid = sky_grid();
        sky = sky_transmittance_at(grid, knot.position + 0.5 * grid.cell * knot.normal);
        let past_hair = irradiance_past_hair(knot.position, knot.normal);
        skin_irradiance += tinted(past_hair, absorbed) * panorama_at(knot.normal, 0u);
    }
    let below = skin_irradiance / PI * mix(strand_view.skin, dense_hair_reflectance(forth + back), dense);
    let cone = sqrt(max(1.0 - sin_o * sin_o, 0.0));
    let other = cross(knot.along, side);
    let behind = environment_around(cone * side - sin_o * knot.along, knot, sky, below, absorbed);
    let ahead = environment_around(-cone * side - sin_o * knot.along, knot, sky, below, absorbed);
    let left = environment_around(cone * other - sin_o * knot.along, knot, sky, below, absorbed);
    let right = environment_around(-cone * other - sin_o * knot.along, knot, sky, below, absorbed);
    let beside = 0.5 * (left + right);
    total += albedo.reflected * (REFLECTED_AROUND.x * behind + REFLECTED_AROUND.y * beside + REFLECTED_AROUND.z * ahead);
    total += albedo.internal * (INTERNAL_AROUND.x * behind + INTERNAL_AROUND.y * beside);
    total += albedo.transmitted * (TRANSMITTED_AROUND.y * beside + TRANSMITTED_AROUND.z * ahead);
    return total + albedo.residual * 0.25 * (behind + ahead + 2.0 * beside);
}

// Knot that an invocation shades. Of coarse strands, every STRIDE-th knot and the last one are shaded.
fn shaded_knot(index: u32) -> u32 {
    let fines = hairs.fine * hairs.fine_knots;
    if (index < fines) {
        return index;
    }
    let points = (hairs.coarse_knots - 2u) / STRIDE + 2u;
    let hair = hairs.fine + (index - fines) / points;
    return first_knot(hair) + min((index - fines) % points * STRIDE, hairs.coarse_knots - 1u);
}

// Whether a segment that the radiance of a knot colours is visible.
fn colours_segments(knot: u32, hair: u32) -> bool {
    let first = first_knot(hair);
    var seen = false;
    for (var k = max(knot, first + STRIDE) - STRIDE; k < min(knot + STRIDE, first + knots_of(hair)); k += 1u) {
        seen |= projected[k].covered == 0u;
    }
    return seen;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = shaded_knot(list_index(group, groups, lane));
    if (index >= total_knot_count(strand_view.coarse)) {
        return;
    }
    let knot = projected[index];
    let hair = hair_of_knot(index);
    let inside = all(knot.position > vec2f(-PICTURE_MARGIN)) && all(knot.position < strand_view.size + PICTURE_MARGIN);
    if (inside && knot.width >= 0.0 && colours_segments(index, hair)) {
        projected[index].radiance = strand_view.light_factors.y * radiance_of(knot_at(hair, index - first_knot(hair)));
    }
}
