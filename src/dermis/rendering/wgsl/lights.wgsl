// Lights with filtered shadow maps.

const POINT: u32 = 0u;
const SPOT: u32 = 1u;
const DIRECTIONAL: u32 = 2u;

struct Light {
    to_map: mat4x4f, // world to the shadow map's clip space
    position: vec3f, // [mm]
    kind: u32,
    direction: vec3f, // from the light to its target
    reference_mm: f32, // distance at which `irradiance` holds
    irradiance: vec3f, // on a surface that faces the light there
    cos_inner: f32,
    cos_outer: f32,
    texel: f32, // side of a shadow texel [mm], for a cone: at 1 mm from the light
    half_width: u32, // of the shadow filter's tent [shadow texel]
    layer: i32, // in the shadow maps, -1 casts none
}

struct Lights {
    light: array<Light, 64>,
}

@group(0) @binding(11) var<uniform> lights: Lights;
@group(0) @binding(12) var shadow_maps: texture_2d_array<f32>; // depth: 1 near, 0 nothing
@group(0) @binding(13) var shadow_sampler: sampler; // non-filtering

struct Incident {
    direction: vec3f, // to the light
    irradiance: vec3f, // on a surface that faces it
}

fn incident(light: Light, p: vec3f) -> Incident {
    if (light.kind == DIRECTIONAL) {
        return Incident(-light.direction, light.irradiance);
    }
    let d = light.position - p;
    let d2 = max(dot(d, d), 1.0);
    let l = d * inverseSqrt(d2);
    var e = light.irradiance * light.reference_mm * light.reference_mm / d2;
    if (light.kind == SPOT) {
        e *= smoothstep(light.cos_outer, light.cos_inner, dot(-l, light.direction));
    }
    return Incident(l, e);
}

// Share of the light that reaches the point: percentage-closer filtering [Reeves1987] under a tent.
// The point moves off the surface by the filter's width, so that the surface does not shade itself.
fn visibility(light: Light, point: Point, l: vec3f) -> f32 {
    if (light.layer < 0) {
        return 1.0;
    }
    var texel = light.texel;
    if (light.kind != DIRECTIONAL) {
        texel *= distance(light.position, point.position);
    }
    let cosine = clamp(dot(point.normal, l), 0.0, 1.0);
    let reach = texel * f32(light.half_width);
    let lifted = point.lit_position + point.normal * (reach * sqrt(1.0 - cosine * cosine)) + l * (0.75 * reach);
    let clip = light.to_map * vec4f(lifted, 1.0);
    if (clip.w <= 0.0) {
        return 1.0;
    }
    let ndc = clip.xyz / clip.w;
    return filtered_depth(light, vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y), ndc.z);
}

fn filtered_depth(light: Light, uv: vec2f, depth: f32) -> f32 {
    let size = vec2f(textureDimensions(shadow_maps));
    let place = uv * size - 0.5;
    let base = floor(place);
    let f = place - base;
    let h = i32(light.half_width);
    let width = f32(h);
    var lit = 0.0;
    for (var j = 1 - h; j < h + 1; j += 2) {
        let wy = max(vec2f(0.0), width - abs(vec2f(f32(j), f32(j + 1)) - f.y));
        for (var i = 1 - h; i < h + 1; i += 2) {
            let wx = max(vec2f(0.0), width - abs(vec2f(f32(i), f32(i + 1)) - f.x));
            // gather returns the quad's texels in the order (0,1) (1,1) (1,0) (0,0)
            let quad = (base + vec2f(f32(i), f32(j)) + 1.0) / size;
            let nearest = textureGather(0, shadow_maps, shadow_sampler, quad, light.layer);
            let free = select(vec4f(0.0), vec4f(1.0), nearest <= vec4f(depth));
            lit += dot(free, vec4f(wx.x * wy.y, wx.y * wy.y, wx.y * wy.x, wx.x * wy.x));
        }
    }
    return lit / (width * width * width * width);
}
