// Intermediate results on the visible surface: irradiance levels, stretch, thickness, shadow and normals.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "layer_colours.wgsl"
//#include "surface/skin.wgsl"
//#include "lights.wgsl"

const SHADOW_VIEW: u32 = 3u; // smaller numbers are layers of the atlas, larger ones normals

struct ViewParameters {
    eye: vec3f,
    quantity: u32, // number of the displayed quantity
    forward: vec3f,
    samples: u32,
    right: vec3f,
    scale: f32, // factor from light to display values; for stretch, mean number of texels per mm
    up: vec3f,
    shift: vec2f, // offset of the image centre from the optical axis, in half images
    jitter: array<vec4f, 64>,
}

@group(0) @binding(30) var<uniform> view_parameters: ViewParameters;
@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>;
@group(0) @binding(32) var layer: texture_2d<f32>; // atlas map of light, stretch or thickness [mm]
@group(0) @binding(33) var bytes: texture_storage_2d<rgba8uint, write>;

// Fraction of the unshadowed light that arrives at a point; 0 on back faces.
fn lit_fraction(point: Point) -> f32 {
    var total = 0.0;
    var visible = 0.0;
    for (var i = 0u; i < skin.light_count; i++) {
        let light = lights.light[i];
        let arriving = incident(light, point.position, 0u);
        let strength = dot(arriving.irradiance, vec3f(1.0)) * f32(parts_of(light));
        total += strength;
        if (dot(point.normal, arriving.direction) > 0.0) {
            visible += strength * visibility(light, point, arriving.direction);
        }
    }
    return visible / max(total, 1e-6);
}

fn displayed_colour(point: Point) -> vec3f {
    let mapped = (point.flags & MAPPED) != 0u && (point.flags & OPAQUE) == 0u;
    if (view_parameters.quantity == SHADOW_VIEW) {
        return vec3f(lit_fraction(point));
    }
    if (view_parameters.quantity > SHADOW_VIEW) {
        return 0.5 + 0.5 * surface_at(point, 0.0).normal;
    }
    if (!mapped) {
        return vec3f(0.0);
    }
    if (view_parameters.quantity == STRETCH_VIEW) { // not interpolated: a mean over several charts is meaningless
        let texel = vec2u(point.atlas_uv * vec2f(textureDimensions(layer)));
        return layer_colour(view_parameters.quantity, textureLoad(layer, texel, 0), view_parameters.scale);
    }
    return layer_colour(view_parameters.quantity, load_bilinear(layer, point.atlas_uv), view_parameters.scale);
}

// Surface point of a triangle under a position of the image.
fn point_under(index: u32, pixel: vec2f, size: vec2f) -> Point {
    let t = triangle_at(index);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let ea = a.position - view_parameters.eye;
    let eb = b.position - view_parameters.eye;
    let ec = c.position - view_parameters.eye;
    let ndc = vec2f(2.0, -2.0) * pixel / size + vec2f(-1.0, 1.0);
    let ray = view_parameters.forward + (ndc.x + view_parameters.shift.x) * view_parameters.right + (ndc.y + view_parameters.shift.y) * view_parameters.up;
    let w = vec3f(dot(cross(eb, ec), ray), dot(cross(ec, ea), ray), dot(cross(ea, eb), ray));
    let inside = max(w * sign(w.x + w.y + w.z), vec3f(0.0));
    let weights = inside / max(inside.x + inside.y + inside.z, 1e-20);
    var point = interpolate(a, b, c, weights, t.w);
    point.atlas_uv = atlas_position(index, weights);
    return point;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(bytes);
    if (any(id.xy >= size)) {
        return;
    }
    var sum = vec3f(0.0);
    for (var s = 0u; s < view_parameters.samples; s++) {
        let triangle = textureLoad(visibility_buffer, id.xy, s, 0).x;
        if (triangle > 0u) {
            let pixel = vec2f(id.xy) + view_parameters.jitter[s].xy;
            sum += clamp(displayed_colour(point_under(triangle - 1u, pixel, vec2f(size))), vec3f(0.0), vec3f(1.0));
        }
    }
    textureStore(bytes, id.xy, vec4u(vec3u(round(255.0 * sum / f32(view_parameters.samples))), 255u));
}
