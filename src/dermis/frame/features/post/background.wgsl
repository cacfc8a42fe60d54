// Background, where the head does not cover the picture: a colour, a studio backdrop, or the environment.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "surface/skin.wgsl"
//#include "environment.wgsl"
//#include "visibility/ray_hit.wgsl"
//#include "exposure.wgsl"

const COLOUR: u32 = 0u;
const GRADIENT: u32 = 1u;
//#fill const BACKDROP_MIDDLE: vec2f = vec2f({backdrop_middle_x}, {backdrop_middle_y}); // brightest point, relative to the picture
//#fill const BACKDROP_BRIGHT: vec3f = vec3f({backdrop_bright_red}, {backdrop_bright_green}, {backdrop_bright_blue});
//#fill const BACKDROP_DARK: vec3f = vec3f({backdrop_dark_red}, {backdrop_dark_green}, {backdrop_dark_blue});
//#fill const BACKDROP_WIDTH: f32 = {backdrop_width}; // standard deviation relative to the longer side of the picture

struct Background {
    rays: Rays,
    kind: u32, // COLOUR, GRADIENT or the environment
    colour: vec3f,
    exposure: f32, // 0 for the metered one
    blur: f32, // roughness of the lobe that blurs the environment, 0 for none
}

@group(0) @binding(30) var<uniform> background: Background;
@group(0) @binding(31) var image: texture_2d<f32>; // radiance and coverage
@group(0) @binding(32) var result: texture_storage_2d<rgba32float, write>;

// Colour in the picture, independent of the exposure.
fn backdrop(position: vec2f, size: vec2f) -> vec3f {
    let from_middle = (position - BACKDROP_MIDDLE * size) / (BACKDROP_WIDTH * max(size.x, size.y));
    return mix(BACKDROP_DARK, BACKDROP_BRIGHT, exp(-0.5 * dot(from_middle, from_middle)));
}

fn environment_at(position: vec2f, size: vec2f) -> vec3f {
    let ray = normalize(ray_to(background.rays, position, size));
    if (background.blur == 0.0) {
        return panorama_at(ray, 0u);
    }
    return reflection(ray, background.blur);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2f(textureDimensions(image));
    if (any(id.xy >= vec2u(size))) {
        return;
    }
    let position = vec2f(id.xy) + 0.5;
    var shown = background.colour;
    if (background.kind == GRADIENT) {
        shown = backdrop(position, size);
    }
    if (background.kind <= GRADIENT) {
        shown /= exposure_of(background.exposure);
    } else {
        shown = environment_at(position, size);
    }
    let head = textureLoad(image, id.xy, 0);
    textureStore(result, id.xy, vec4f(head.rgb + (1.0 - head.a) * shown, head.a));
}
