// What lies on the way to the picture, over the pixels that see it: levels of light, stretch, thickness, shadow, normals.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "layer_colours.wgsl"
//#include "surface/skin.wgsl"
//#include "lights.wgsl"

const SHADOW_VIEW: u32 = 3u; // before it the layers of the atlas, after it normals

struct Look {
    eye: vec3f,
    what: u32, // a layer of the atlas, shadow, or normals
    forward: vec3f,
    samples: u32,
    right: vec3f,
    scale: f32, // of light to the display, or the mean texels per mm
    up: vec3f,
    shift: vec2f, // of the picture's middle from the axis, in half pictures
    jitter: array<vec4f, 64>,
}

@group(0) @binding(30) var<uniform> look: Look;
@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>;
@group(0) @binding(32) var layer: texture_2d<f32>; // of the atlas: light, stretch, or thickness [mm]
@group(0) @binding(33) var bytes: texture_storage_2d<rgba8uint, write>;

// Share of the lights' own light that arrives; back faces see none.
fn lit_share(point: Point) -> f32 {
    var all = 0.0;
    var seen_of_all = 0.0;
    for (var i = 0u; i < skin.light_count; i++) {
        let light = lights.light[i];
        let arriving = incident(light, point.position, 0u);
        let strength = dot(arriving.irradiance, vec3f(1.0)) * f32(parts_of(light));
        all += strength;
        if (dot(point.normal, arriving.direction) > 0.0) {
            seen_of_all += strength * visibility(light, point, arriving.direction);
        }
    }
    return seen_of_all / max(all, 1e-6);
}

fn shown(point: Point) -> vec3f {
    let mapped = (point.flags & MAPPED) != 0u && (point.flags & OPAQUE) == 0u;
    if (look.what == SHADOW_VIEW) {
        return vec3f(lit_share(point));
    }
    if (look.what > SHADOW_VIEW) {
        return 0.5 + 0.5 * surface_at(point, 0.0).normal;
    }
    if (!mapped) {
        return vec3f(0.0);
    }
    if (look.what == STRETCH_VIEW) { // a mean of shears of several charts would mean nothing
        let texel = vec2u(point.place * vec2f(textureDimensions(layer)));
        return layer_colour(look.what, textureLoad(layer, texel, 0), look.scale);
    }
    return layer_colour(look.what, load_bilinear(layer, point.place), look.scale);
}

// The point of a triangle under a place of the image.
fn point_under(index: u32, place: vec2f, size: vec2f) -> Point {
    let t = triangle_at(index);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let ea = a.position - look.eye;
    let eb = b.position - look.eye;
    let ec = c.position - look.eye;
    let ndc = vec2f(2.0, -2.0) * place / size + vec2f(-1.0, 1.0);
    let ray = look.forward + (ndc.x + look.shift.x) * look.right + (ndc.y + look.shift.y) * look.up;
    let w = vec3f(dot(cross(eb, ec), ray), dot(cross(ec, ea), ray), dot(cross(ea, eb), ray));
    let inside = max(w * sign(w.x + w.y + w.z), vec3f(0.0));
    let weights = inside / max(inside.x + inside.y + inside.z, 1e-20);
    var point = interpolate(a, b, c, weights, t.w);
    point.place = place_of_point(index, weights);
    return point;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(bytes);
    if (any(id.xy >= size)) {
        return;
    }
    var sum = vec3f(0.0);
    for (var s = 0u; s < look.samples; s++) {
        let triangle = textureLoad(visibility_buffer, id.xy, s, 0).x;
        if (triangle > 0u) {
            let place = vec2f(id.xy) + look.jitter[s].xy;
            sum += clamp(shown(point_under(triangle - 1u, place, vec2f(size))), vec3f(0.0), vec3f(1.0));
        }
    }
    textureStore(bytes, id.xy, vec4u(vec3u(round(255.0 * sum / f32(look.samples))), 255u));
}
