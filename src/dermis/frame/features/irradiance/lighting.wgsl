// Light of all sources at a point of the head: the part that enters the skin, and the part that is reflected at the surface.
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
//#include "mirrored_lights.wgsl"
//#include "irradiance/below_cornea.wgsl"
//#if WORN
//#include "sheen.wgsl"
//#end
//#if VELLUS
//#include "vellus.wgsl"
//#end

// Whether each point skips lights behind its surface. Without it, software adapters shade a point with all lights that its
// neighbours see; GPUs are faster when all points read the same light.
override SKIPS_UNLIT: bool = false;

const MIN_OBLIQUE_COSINE: f32 = -0.75; // least cosine of oblique light at the point where it enters

struct Lit {
    entered: vec3f, // irradiance that enters the skin, times its reflectance relative to normal incidence
    reflected: vec3f, // radiance reflected by the surface
    directional: vec3f, // part of `entered` by which the light towards the eye exceeds the mean over exit directions
    across: vec3f, // `entered`, times the relative transmittance of deep slabs
    vellus: vec3f, // radiance scattered by vellus hair
}

// Reflecting film over a surface.
struct Film {
    normal: vec3f,
    scattered: vec3f, // fraction of the light that reaches shadows by scattering around the point
    ambient: vec3f, // fraction of ambient light that arrives
    smoothness: f32, // 1 for a film that mirrors area lights, 0 for one that reflects by the lobe of its roughness
    below: BelowCornea,
}

// Film without smoothness over a surface that all light reaches.
fn plain_film(normal: vec3f, scattered: vec3f) -> Film {
    return Film(normal, scattered, vec3f(1.0), 0.0, NO_CORNEA);
}

// Normal clamped to the horizon of the eye: beyond it the lobe is undefined.
fn visible_normal(normal: vec3f, v: vec3f) -> vec3f {
    let clamped = normal - min(dot(normal, v), 0.0) * v;
    return clamped / max(length(clamped), 1e-3);
}

// Excess of the light towards the eye over the mean of all directions, relative to all light below the skin. Only single
// scattering, which entered at this point, depends on direction.
// reflectance : of `entered`
fn directional_fraction(lit: Lit, reflectance: vec3f, below: vec3f) -> vec3f {
    return reflectance * lit.directional / max(max(reflectance * lit.entered, below), vec3f(1e-12));
}

// Index of the first light, from `first` on, that can reach a point, or of the last light.
fn next_possible_light(first: u32, p: vec3f, n: vec3f) -> u32 {
    var i = first;
    loop {
        let light = lights.light[i];
        let behind = select(0.0, MIN_OBLIQUE_COSINE, OBLIQUE);
        if (light.punctual == 0u || dot(towards_light(light, p), n) > behind || i + 1u >= skin.light_count) {
            break;
        }
        i++;
    }
    return i;
}

// Index of the first part of a light in front of a surface, or the number of parts if there is none.
fn first_facing_part(light: Light, p: vec3f, n: vec3f) -> u32 {
    var part = 0u;
    loop {
        if (dot(n, incident(light, p, part).direction) > 0.0 || part >= parts_of(light)) {
            break;
        }
        part++;
    }
    return part;
}

// Visibility of a light from a point, past the head and its hair.
fn total_visibility(light: Light, point: Point, l: vec3f) -> f32 {
    return visibility(light, point, l) * strand_transmittance(light, point.position);
}

// Fraction of the irradiance by the environment that passes hair.
fn irradiance_past_hair(p: vec3f, normal: vec3f) -> f32 {
    let moments = SkyMoments(environment.sky_moments[0], environment.sky_moments[1].xyz, environment.sky_moments[2].xyz);
    let open = max(received(moments, normal), 1e-4);
    return saturate(received_past_hair(sky_grid(), p, normal, open) / open);
}

// Position at which transmittances are read for a surface: below it, so that directions from there pass through the whole layer of
// hair on it.
fn below_hair(point: Point) -> vec3f {
    return point.position - sky_grid().cell * point.normal;
}

// Fraction of the light of the environment from a direction that hair transmits to a point; 1 without occlusion.
fn sky_past_hair(point: Point, direction: vec3f) -> f32 {
    if (!STRANDS || environment.occluded == 0u) {
        return 1.0;
    }
    let hair = sky_transmittance_at(sky_grid(), below_hair(point)).hair;
    return saturate(hair.w + dot(hair.xyz, direction));
}

// Irradiance that enters from the environment and from other skin. With interreflection, the fit of `ambient` to the light from
// other skin is left out.
fn ambient_entering(point: Point, surface: Surface, open: f32) -> vec3f {
    let has_cells = INTERREFLECTION && (point.flags & MAPPED) != 0u;
    var entering = vec3f(0.0);
    if (ENVIRONMENT) {
        let albedo = select(surface.colour * environment.albedo, vec3f(0.0), has_cells);
        entering = ambient(surface.normal, open, albedo) * enters_uniform(surface.roughness, surface.rho_s);
        if (STRANDS && environment.occluded != 0u) {
            entering *= irradiance_past_hair(below_hair(point), point.normal);
        }
    }
    if (has_cells) {
        // with occlusion, cells give only the brightness of the occluded part
        entering += from_skin_at(point.atlas_uv) * select(1.0, 1.0 - open, environment.occluded != 0u);
    }
    return entering;
}

// open : unoccluded fraction of the sky
fn illuminate(point: Point, surface: Surface, v: vec3f, open: f32) -> Lit {
    return illuminate_film(point, surface, plain_film(surface.normal, vec3f(0.0)), v, open);
}

fn illuminate_film(point: Point, surface: Surface, film: Film, v: vec3f, open: f32) -> Lit {
    var lit = Lit(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let mirror = visible_normal(film.normal, v);
    let smoothness = select(0.0, film.smoothness, EYES && SHAPES);
    let directional = HALF_SPACE && (point.flags & OPAQUE) == 0u;
    let facing = clamp(dot(surface.normal, v), 0.0, 1.0);
    // loops have their test at the end: with it at the start, software adapters run one more iteration
    var i = 0u;
    loop {
        if (skin.light_count == 0u) {
            break;
        }
        if (SKIPS_UNLIT) {
            i = next_possible_light(i, point.position, surface.normal);
        }
        let light = lights.light[i];
        // computed once for all parts, outside branches, which software adapters run in each iteration
        let offset = oblique_offset_of(light, point.normal, towards_light(light, point.position));
        let position = point.position + offset.position;
        let normal = normal_at_offset(surface.normal, offset);
        var part = first_facing_part(light, position, normal);
        if (part < parts_of(light)) {
            let seen = total_visibility(light, offset_point(point, offset), incident(light, position, part).direction);
            let rough = 1.0 - smoothness * f32(1u - light.punctual);
            if (EYES && SHAPES && smoothness > 0.0) {
                let radiance = seen * mirrored_radiance(light, point.position, reflect(-v, mirror));
                lit.reflected += (1.0 - rough) * surface.rho_s * surface_albedo(dot(mirror, v), surface.roughness).x * radiance;
            }
            loop {
                let arriving = incident(light, position, part);
                let cosine = dot(normal, arriving.direction);
                if (cosine > 0.0) {
                    let e = arriving.irradiance * seen;
                    let filled = arriving.irradiance * max(vec3f(seen), film.scattered);
                    var entering = filled * (cosine * enters(cosine, surface.roughness, surface.rho_s));
                    if (EYES) {
                        entering *= light_below_cornea(film.below, arriving.direction, cosine);
                    }
                    if (directional) {
                        lit.directional += entering * directional_excess(cosine, facing);
                        entering *= relative_reflectance(cosine);
                        lit.across += entering * relative_transmittance(cosine);
                    }
                    lit.entered += entering;
                    let factor = rough * surface.rho_s * max(dot(mirror, arriving.direction), 0.0);
                    lit.reflected += e * (factor * lobe(mirror, arriving.direction, v, surface.roughness));
                    //#if WORN
                    lit.reflected += e * sheen_lobe(mirror, arriving.direction, v, cosine);
                    //#end
                    //#if VELLUS
                    lit.vellus += e * vellus_lobe(point.normal, arriving.direction, v);
                    //#end
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
        var entering = ambient_entering(point, surface, open) * film.ambient;
        if (directional) {
            lit.directional += entering * uniform_directional_excess(facing);
            entering *= skin.uniform_reflectance;
            lit.across += entering;
        }
        lit.entered += entering;
        //#if VELLUS
        lit.vellus += entering * vellus_of_uniform(point.normal, v);
        //#end
        //#if WORN
        lit.reflected += entering * sheen_of_uniform(mirror, v);
        //#end
    }
    if (ENVIRONMENT) {
        var albedo = surface.rho_s * surface_albedo(dot(mirror, v), surface.roughness).x;
        //#if METALS
        albedo = mix(albedo, 1.0, metalness);
        //#end
        lit.reflected += albedo * mirrored(point, mirror, v, surface.roughness, open) * sky_past_hair(point, mirror);
    }
    return lit;
}
