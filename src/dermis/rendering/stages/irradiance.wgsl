// Light that enters the skin at each texel of the atlas, times the share of the colour map applied before scattering.
//#include "geometry.wgsl"
//#include "bilinear.wgsl"
//#include "skin.wgsl"
//#include "lobe.wgsl"
//#include "lights.wgsl"
//#include "environment.wgsl"

@group(1) @binding(0) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(1) @binding(1) var entered: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(atlas);
    if (any(id.xy >= size)) {
        return;
    }
    let texel = textureLoad(atlas, id.xy, 0);
    if (texel.x == 0u) {
        textureStore(entered, id.xy, vec4f(0.0));
        return;
    }
    let t = triangle_at(texel.x - 1u);
    let w = unpack2x16unorm(texel.y);
    let point = interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), vec3f(1.0 - w.x - w.y, w), t.w);
    let surface = surface_at(point, 1.0 / f32(size.x));
    var sum = vec3f(0.0);
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
                sum += arriving.irradiance * (cosine * seen * enters(cosine, surface.roughness, surface.rho_s));
            }
        }
    }
    if (ENVIRONMENT) {
        let around = ambient(surface.normal, open_at(point.uv), surface.colour * environment.albedo);
        sum += around * enters_from_everywhere(surface.roughness, surface.rho_s);
    }
    textureStore(entered, id.xy, vec4f(sum * share_of(surface.colour, skin.mix), 1.0));
}
