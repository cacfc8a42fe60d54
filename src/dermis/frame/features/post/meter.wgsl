// The meter's points, a grid over the picture: light that falls on the skin that is seen there, and how bright it is shown.
//#include "irradiance/lighting.wgsl"
//#include "occlusion/open_sky.wgsl"
//#include "visibility/ray_hit.wgsl"

//#fill const METER_SIDE: u32 = {meter_side}u; // points along each side of the grid
const LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722); // of linear Rec. 709
const NO_SKIN: f32 = -1.0;

struct Look {
    rays: Rays,
    place: vec2f, // of the first sample in its pixel
}

@group(0) @binding(30) var<uniform> look: Look;
@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>;
@group(0) @binding(32) var image: texture_2d<f32>; // radiance
@group(0) @binding(33) var<storage, read_write> points: array<vec2f>; // luminance of white skin; largest part of the radiance

fn metered_at(triangle: u32, pixel: vec2u, size: vec2f) -> vec2f {
    let t = triangle_at(triangle);
    if ((t.w & OPAQUE) != 0u) {
        return vec2f(NO_SKIN);
    }
    let w = ray_weights(t, ray_to(look.rays, vec2f(pixel) + look.place, size), look.rays.eye);
    var point = point_on_triangle(triangle, w);
    point.flags = (point.flags | OPAQUE) & ~MAPPED; // what falls on it, whatever its tissue and other skin make of that
    let black = Surface(point.normal, vec3f(0.0), 1.0, 0.0);
    let lit = light_up(point, black, point.normal, open_sky(point, t, w));
    let shown = textureLoad(image, pixel, 0).rgb;
    return vec2f(dot(LUMINANCE, lit.entered) / PI, max(shown.r, max(shown.g, shown.b)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(METER_SIDE))) {
        return;
    }
    let size = textureDimensions(visibility_buffer);
    let pixel = (2u * id.xy + 1u) * size / (2u * METER_SIDE);
    let triangle = textureLoad(visibility_buffer, pixel, 0, 0).x;
    var found = vec2f(NO_SKIN);
    // A loop, because software adapters run both sides of a branch for all points, and a loop only while one needs it.
    loop {
        if (triangle == 0u) {
            break;
        }
        found = metered_at(triangle - 1u, pixel, vec2f(size));
        break;
    }
    points[id.y * METER_SIDE + id.x] = found;
}
