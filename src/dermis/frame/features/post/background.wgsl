// What is behind the head, under what the head leaves uncovered: a colour, a studio's backdrop, or the surroundings.
//#include "shape/geometry.wgsl"
//#include "bilinear.wgsl"
//#include "surface/skin.wgsl"
//#include "environment.wgsl"
//#include "visibility/ray_hit.wgsl"
//#include "exposure.wgsl"

const COLOUR: u32 = 0u;
const GRADIENT: u32 = 1u;
const BACKDROP_MIDDLE: vec2f = vec2f(0.5, 0.42); // of the backdrop's light, in a square picture
const BACKDROP_BRIGHT: f32 = 0.16;
const BACKDROP_DARK: f32 = 0.012;
const BACKDROP_WIDTH: f32 = 0.42; // standard deviation over the picture's longer side

struct Behind {
    rays: Rays,
    kind: u32, // COLOUR, GRADIENT or the environment
    colour: vec3f,
    exposure: f32, // 0 for the meter's
    blur: f32, // roughness at which the environment is mirrored, 0 for none
}

@group(0) @binding(30) var<uniform> behind: Behind;
@group(0) @binding(31) var image: texture_2d<f32>; // radiance and coverage
@group(0) @binding(32) var result: texture_storage_2d<rgba32float, write>;

// As the picture is to show it, whatever the exposure.
fn backdrop(place: vec2f, size: vec2f) -> vec3f {
    let from_middle = (place - BACKDROP_MIDDLE * size) / (BACKDROP_WIDTH * max(size.x, size.y));
    return vec3f(mix(BACKDROP_DARK, BACKDROP_BRIGHT, exp(-0.5 * dot(from_middle, from_middle))));
}

fn surroundings(place: vec2f, size: vec2f) -> vec3f {
    let ray = normalize(ray_to(behind.rays, place, size));
    if (behind.blur == 0.0) {
        return panorama_at(ray, 0u);
    }
    return reflection(ray, behind.blur);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2f(textureDimensions(image));
    if (any(id.xy >= vec2u(size))) {
        return;
    }
    let place = vec2f(id.xy) + 0.5;
    var shown = behind.colour;
    if (behind.kind == GRADIENT) {
        shown = backdrop(place, size);
    }
    if (behind.kind <= GRADIENT) {
        shown /= exposure_of(behind.exposure);
    } else {
        shown = surroundings(place, size);
    }
    let over = textureLoad(image, id.xy, 0);
    textureStore(result, id.xy, vec4f(over.rgb + (1.0 - over.a) * shown, over.a));
}
