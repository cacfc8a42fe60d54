// Light from everywhere at a point of the head: the part that enters the skin, and the part that the surface reflects.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "surface/skin.wgsl"
//#include "direction.wgsl"
//#include "surface/lobe.wgsl"
//#include "lights.wgsl"
//#include "oblique.wgsl"
//#include "hair/strand_shadows.wgsl"
//#include "environment.wgsl"
//#include "interreflection/interreflection.wgsl"

// Whether each point skips the lights behind its surface by itself. Without that, software adapters shade it with every light
// that a point beside it sees. GPUs do without: they read lights faster when all points read the same one.
override SKIPS_UNLIT: bool = false;

const MOST_BEHIND: f32 = -0.75; // cosine at which oblique light may still shine

struct Lit {
    entered: vec3f, // irradiance that enters the skin, times the share that comes back over that from straight above
    reflected: vec3f, // radiance off the surface
    directional: vec3f, // part of `entered` that leaves towards the eye beyond the mean over all directions
    across: vec3f, // `entered`, by what passes deep slabs of it
}

// What lies over a surface and reflects.
struct Film {
    normal: vec3f,
    scattered: vec3f, // share of a light that arrives in its shadow, by scattering in what is around
}

// The normal, turned back to the eye's horizon where the relief faces away: beyond it a lobe is undefined, and unbounded with
// light from behind the head.
fn seen_normal(normal: vec3f, v: vec3f) -> vec3f {
    let turned = normal - min(dot(normal, v), 0.0) * v;
    return turned / max(length(turned), 1e-3);
}

// Light that leaves towards the eye beyond the mean of all directions, over all light below the skin. Only light that scattered
// once, and so entered here, depends on direction; the rest, from around, leaves evenly.
// share: of `entered` that comes back
fn directional_share(lit: Lit, share: vec3f, below: vec3f) -> vec3f {
    return share * lit.directional / max(max(share * lit.entered, below), vec3f(1e-12));
}

// The first light from `first` on that a point may see, or the last.
fn next_that_may_shine(first: u32, p: vec3f, n: vec3f) -> u32 {
    var i = first;
    loop {
        let light = lights.light[i];
        let behind = select(0.0, MOST_BEHIND, OBLIQUE);
        if (light.punctual == 0u || dot(towards_light(light, p), n) > behind || i + 1u >= skin.light_count) {
            break;
        }
        i++;
    }
    return i;
}

// The first part of a light that is in front of a surface; how many parts there are where none is.
fn first_that_faces(light: Light, p: vec3f, n: vec3f) -> u32 {
    var part = 0u;
    loop {
        if (dot(n, incident(light, p, part).direction) > 0.0 || part >= parts_of(light)) {
            break;
        }
        part++;
    }
    return part;
}

// Share of a light from a direction that reaches a point, past the head and its hairs.
fn reaching(light: Light, point: Point, l: vec3f) -> f32 {
    return visibility(light, point, l) * strand_transmittance(light, point.position);
}

// Light that enters from all around: from the environment, and from other skin. Where that is known, the environment's own guess
// of it is left out.
fn entering_from_around(point: Point, surface: Surface, open: f32) -> vec3f {
    let linked = INTERREFLECTION && (point.flags & MAPPED) != 0u;
    var entering = vec3f(0.0);
    if (ENVIRONMENT) {
        let albedo = select(surface.colour * environment.albedo, vec3f(0.0), linked);
        entering = ambient(surface.normal, open, albedo) * enters_from_everywhere(surface.roughness, surface.rho_s);
    }
    if (linked) {
        // Where it is known how much of the sky is hidden, cells say only how bright that is.
        entering += from_skin_at(point.place) * select(1.0, 1.0 - open, environment.occluded != 0u);
    }
    return entering;
}

// open: share of the sky that the point sees
fn light_up(point: Point, surface: Surface, v: vec3f, open: f32) -> Lit {
    return light_through(point, surface, Film(surface.normal, vec3f(0.0)), v, open);
}

fn light_through(point: Point, surface: Surface, film: Film, v: vec3f, open: f32) -> Lit {
    var lit = Lit(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let mirror = seen_normal(film.normal, v);
    let by_direction = HALF_SPACE && (point.flags & OPAQUE) == 0u;
    let facing = clamp(dot(surface.normal, v), 0.0, 1.0);
    // Loops have their test at the end: with it at the start, software adapters run them once more.
    var i = 0u;
    loop {
        if (skin.light_count == 0u) {
            break;
        }
        if (SKIPS_UNLIT) {
            i = next_that_may_shine(i, point.position, surface.normal);
        }
        let light = lights.light[i];
        // Once for all parts, and not where the first of them is shaded: software adapters run what is in a branch for
        // each round of the loop around it.
        let aside = aside_of(light, point.normal, towards_light(light, point.position));
        let place = point.position + aside.moved;
        let normal = turned(surface.normal, aside);
        var part = first_that_faces(light, place, normal);
        if (part < parts_of(light)) {
            let seen = reaching(light, moved_point(point, aside), incident(light, place, part).direction);
            loop {
                let arriving = incident(light, place, part);
                let cosine = dot(normal, arriving.direction);
                if (cosine > 0.0) {
                    let e = arriving.irradiance * seen;
                    let filled = arriving.irradiance * max(vec3f(seen), film.scattered);
                    var entering = filled * (cosine * enters(cosine, surface.roughness, surface.rho_s));
                    if (by_direction) {
                        lit.directional += entering * beyond_mean(cosine, facing);
                        entering *= coming_back(cosine);
                        lit.across += entering * going_across(cosine);
                    }
                    lit.entered += entering;
                    let share = surface.rho_s * max(dot(mirror, arriving.direction), 0.0);
                    lit.reflected += e * (share * lobe(mirror, arriving.direction, v, surface.roughness));
                }
                part++;
                if (part >= parts_of(light)) {
                    break;
                }
            }
        }
        i++;
        if (i >= skin.light_count) {
            break;
        }
    }
    if (ENVIRONMENT || INTERREFLECTION) {
        var entering = entering_from_around(point, surface, open);
        if (by_direction) {
            lit.directional += entering * beyond_mean_from_everywhere(facing);
            entering *= skin.back_from_everywhere;
            lit.across += entering;
        }
        lit.entered += entering;
    }
    if (ENVIRONMENT) {
        let albedo = surface.rho_s * surface_albedo(dot(mirror, v), surface.roughness).x;
        lit.reflected += albedo * mirrored(point, mirror, v, surface.roughness, open);
    }
    return lit;
}
