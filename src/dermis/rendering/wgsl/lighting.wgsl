// What all light does at a point of the head: some of it enters the skin, some is reflected by the surface.
//#include "geometry.wgsl"
//#include "bilinear.wgsl"
//#include "skin.wgsl"
//#include "lobe.wgsl"
//#include "lights.wgsl"
//#include "environment.wgsl"

struct Lit {
    entered: vec3f, // irradiance that enters the skin
    reflected: vec3f, // radiance off the surface
}

// The normal of the facets that are seen: where the relief turns away from the eye, it is turned back to the horizon. A lobe
// has no value beyond it, and with light from behind the head none that is finite.
fn seen_normal(normal: vec3f, v: vec3f) -> vec3f {
    let turned = normal - min(dot(normal, v), 0.0) * v;
    return turned / max(length(turned), 1e-3);
}

// open: share of the sky that the point sees
fn light_up(point: Point, surface: Surface, v: vec3f, open: f32) -> Lit {
    var lit = Lit(vec3f(0.0), vec3f(0.0));
    let mirror = seen_normal(surface.normal, v);
    for (var i = 0u; i < skin.light_count; i++) {
        let light = lights.light[i];
        var seen = -1.0; // how much of the light: not known yet
        for (var part = 0u; part < parts_of(light); part++) {
            let arriving = incident(light, point.position, part);
            let cosine = dot(surface.normal, arriving.direction);
            if (cosine > 0.0) {
                if (seen < 0.0) {
                    seen = visibility(light, point, arriving.direction);
                }
                let e = arriving.irradiance * seen;
                lit.entered += e * (cosine * enters(cosine, surface.roughness, surface.rho_s));
                let share = surface.rho_s * max(dot(mirror, arriving.direction), 0.0);
                lit.reflected += e * (share * lobe(mirror, arriving.direction, v, surface.roughness));
            }
        }
    }
    if (ENVIRONMENT) {
        let around = ambient(surface.normal, open, surface.colour * environment.albedo);
        let albedo = surface.rho_s * surface_albedo(dot(mirror, v), surface.roughness).x;
        lit.entered += around * enters_from_everywhere(surface.roughness, surface.rho_s);
        lit.reflected += albedo * mirrored(point, mirror, v, surface.roughness, open);
    }
    return lit;
}
