// Measurements on a grid over the picture: irradiance of the visible skin, and its radiance.
//#include "irradiance/lighting.wgsl"
//#include "occlusion/open_sky.wgsl"
//#include "visibility/ray_hit.wgsl"

//#fill const METER_SIDE: u32 = {meter_side}u; // points along each side of the grid
const LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722); // of linear Rec. 709
const NO_SKIN: f32 = -1.0;

struct MeterCamera {
    rays: Rays,
    sample: vec2f, // position of the first sample in its pixel
}

@group(0) @binding(30) var<uniform> camera: MeterCamera;
@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>;
@group(0) @binding(32) var image: texture_2d<f32>; // radiance
@group(0) @binding(33) var<storage, read_write> points: array<vec2f>; // x: luminance that white skin would have, -1 without skin; y: largest channel of the radiance

fn metered_at(triangle: u32, pixel: vec2u, size: vec2f) -> vec2f {
    let t = triangle_at(triangle);
    if ((t.w & OPAQUE) != 0u) {
        return vec2f(NO_SKIN);
    }
    let w = ray_weights(t, ray_to(camera.rays, vec2f(pixel) + camera.sample, size), camera.rays.eye);
    var point = point_on_triangle(triangle, w);
    point.flags = (point.flags | OPAQUE) & ~MAPPED; // incident light only, without scattering and interreflection
    let black = Surface(point.normal, vec3f(0.0), 1.0, 0.0);
    let lit = illuminate(point, black, point.normal, open_sky(point, t, w));
    let radiance = textureLoad(image, pixel, 0).rgb;
    return vec2f(dot(LUMINANCE, lit.entered) / PI, max(radiance.r, max(radiance.g, radiance.b)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(METER_SIDE))) {
        return;
    }
    let size = textureDimensions(visibility_buffer);
    let pixel = (2u * id.xy + 1u) * size / (2u * METER_SIDE);
    let triangle = textureLoad(visibility_buffer, pixel, 0, 0).x;
    var measurement = vec2f(NO_SKIN);
    // A loop instead of a branch: software adapters run both sides of a branch for all points.
    loop {
        if (triangle == 0u) {
            break;
        }
        measurement = metered_at(triangle - 1u, pixel, vec2f(size));
        break;
    }
    points[id.y * METER_SIDE + id.x] = measurement;
}
