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

// open: share of the sky that the point sees
fn light_up(point: Point, surface: Surface, v: vec3f, open: f32) -> Lit {
    var lit = Lit(vec3f(0.0), vec3f(0.0));
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
                let e = arriving.irradiance * (cosine * seen);
                lit.entered += e * enters(cosine, surface.roughness, surface.rho_s);
                lit.reflected += e * surface.rho_s * lobe(surface.normal, arriving.direction, v, surface.roughness);
            }
        }
    }
    if (ENVIRONMENT) {
        let around = ambient(surface.normal, open, surface.colour * environment.albedo);
        let albedo = surface.rho_s * surface_albedo(dot(surface.normal, v), surface.roughness).x;
        lit.entered += around * enters_from_everywhere(surface.roughness, surface.rho_s);
        lit.reflected += albedo * mirrored(point, surface.normal, v, surface.roughness, open);
    }
    return lit;
}
