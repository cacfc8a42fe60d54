// Separable diffusion kernel along one axis: diffuses subsurface light along the rows or columns of the picture [Jimenez2015].

override AXIS: u32 = 0u; // 0 along rows, 1 along columns

const TAPS: u32 = 16u; // on each side; consecutive pixels if these cover the reach, else at increasing distances
const MAX_SLOPE: f32 = 4.0; // largest ratio of a change of depth to the width within one surface

struct Blur {
    half: vec2f, // half size of the picture on a plane at distance 1
    shift: vec2f, // offset of the centre of the picture on that plane, in half sizes
    reach: f32, // of the kernel [mm]
}

@group(0) @binding(0) var<uniform> blur: Blur;
@group(0) @binding(1) var source: texture_2d<f32>; // light below the skin; alpha is depth [mm], 0 without skin
@group(0) @binding(2) var kernel: texture_2d<f32>; // fraction of the light on one side up to a distance, tabulated by the square root of the distance
@group(0) @binding(3) var blurred: texture_storage_2d<rgba32float, write>;

// Position of a pixel's surface in camera space [mm].
fn position_of_pixel(pixel: vec2i, depth: f32) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * (vec2f(pixel) + 0.5) / vec2f(textureDimensions(source)) + vec2f(-1.0, 1.0);
    return depth * vec3f((ndc + blur.shift) * blur.half, 1.0);
}

// Fraction of the light on one side, up to a distance.
fn fraction_within(distance: f32) -> vec3f {
    let last = f32(textureDimensions(kernel).x - 1u);
    let at = last * sqrt(min(distance / blur.reach, 1.0));
    let low = min(floor(at), last - 1.0);
    let below = textureLoad(kernel, vec2u(u32(low), 0u), 0).rgb;
    let above = textureLoad(kernel, vec2u(u32(low) + 1u, 0u), 0).rgb;
    return mix(below, above, at - low);
}

// Light from one side. Each tap covers the surface up to halfway to its neighbours, measured on the surface, or up to the
// edge of its own pixels where a neighbour is on another surface. Distances that no tap covers get the light of the centre:
// the weights sum to 1/2.
fn from_side(here: vec2i, centre: vec4f, step: vec2i) -> vec3f {
    let position = position_of_pixel(here, centre.a);
    let pixel = distance(position, position_of_pixel(here + step, centre.a));
    let reach = blur.reach / pixel;
    var sum = vec3f(0.0);
    var total = vec3f(0.0); // sum of the weights
    var tap = centre;
    var at = 0.0; // distance of the tap
    var nearer = vec3f(0.0); // fraction of the light from distances below those that the tap covers
    var before = 0u;
    var half = 0.5 * pixel; // to its neighbour
    for (var k = 1u; k <= TAPS; k++) {
        let part = f32(k) / f32(TAPS);
        let n = max(k, u32(round(reach * part * part)));
        let pixels = here + i32(n) * step;
        if (any(pixels < vec2i(0)) || any(pixels >= vec2i(textureDimensions(source)))) {
            break;
        }
        let next = textureLoad(source, pixels, 0);
        let away = distance(position, position_of_pixel(pixels, next.a));
        half = 0.5 * pixel * f32(n - before);
        let joined = min(tap.a, next.a) > 0.0 && away > at && away - at <= 2.0 * MAX_SLOPE * half;
        let middle = 0.5 * (at + away);
        let weight = weight_of_tap(tap, nearer, select(at + half, middle, joined));
        sum += weight * tap.rgb;
        total += weight;
        nearer = fraction_within(select(max(away - half, 0.0), middle, joined));
        tap = next;
        at = away;
        before = n;
    }
    let weight = weight_of_tap(tap, nearer, at + half);
    sum += weight * tap.rgb;
    total += weight;
    return sum * min(0.5 / max(total, vec3f(1e-6)), vec3f(1.0)) + max(0.5 - total, vec3f(0.0)) * centre.rgb;
}

// Fraction of the light from the distances that a tap covers, 0 for pixels without skin.
fn weight_of_tap(tap: vec4f, nearer: vec3f, farthest: f32) -> vec3f {
    return select(vec3f(0.0), fraction_within(farthest) - nearer, tap.a > 0.0);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(source))) {
        return;
    }
    let here = vec2i(id.xy);
    let centre = textureLoad(source, here, 0);
    if (centre.a == 0.0) {
        textureStore(blurred, here, centre);
        return;
    }
    let step = select(vec2i(0, 1), vec2i(1, 0), AXIS == 0u);
    let light = from_side(here, centre, step) + from_side(here, centre, -step);
    textureStore(blurred, here, vec4f(light, centre.a));
}
