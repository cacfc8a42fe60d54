// One axis of the separable kernel: spreads light below the skin along the picture's rows or columns [Jimenez2015].

override AXIS: u32 = 0u; // 0 along rows, 1 along columns

const TAPS: u32 = 16u; // on each side, on neighbouring pixels where these reach far enough, else ever farther apart
const STEEPEST: f32 = 4.0; // largest change of depth over width within one surface

struct Spread {
    half: vec2f, // of the picture on a plane at distance 1 before the eye
    shift: vec2f, // of its middle there, in these
    reach: f32, // of the kernel [mm]
}

@group(0) @binding(0) var<uniform> spread: Spread;
@group(0) @binding(1) var source: texture_2d<f32>; // light below the skin; depth [mm], 0 where there is no skin
@group(0) @binding(2) var kernel: texture_2d<f32>; // share of the light that goes to one side up to a distance, by its root
@group(0) @binding(3) var blurred: texture_storage_2d<rgba32float, write>;

// Position of a pixel's surface in camera space [mm].
fn place_of(pixel: vec2i, depth: f32) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * (vec2f(pixel) + 0.5) / vec2f(textureDimensions(source)) + vec2f(-1.0, 1.0);
    return depth * vec3f((ndc + spread.shift) * spread.half, 1.0);
}

// Share of the light that goes to one side, up to a distance.
fn share_within(distance: f32) -> vec3f {
    let last = f32(textureDimensions(kernel).x - 1u);
    let at = last * sqrt(min(distance / spread.reach, 1.0));
    let low = min(floor(at), last - 1.0);
    let below = textureLoad(kernel, vec2u(u32(low), 0u), 0).rgb;
    let above = textureLoad(kernel, vec2u(u32(low) + 1u, 0u), 0).rgb;
    return mix(below, above, at - low);
}

// Light from one side. Each tap covers the surface up to halfway to its neighbours, measured on the surface, or up to the
// edge of its own pixels where a neighbour is on another surface. Distances that no tap covers get the centre's light, so
// the weights always sum to 1/2, and each surface that the row crosses counts by its own distance.
fn from_side(here: vec2i, centre: vec4f, step: vec2i) -> vec3f {
    let place = place_of(here, centre.a);
    let pixel = distance(place, place_of(here + step, centre.a));
    let reach = spread.reach / pixel;
    var sum = vec3f(0.0);
    var total = vec3f(0.0); // of the weights
    var tap = centre;
    var at = 0.0; // its distance
    var nearer = vec3f(0.0); // share of the light from nearer than it covers
    var before = 0u;
    var half = 0.5 * pixel; // between it and its neighbour
    for (var k = 1u; k <= TAPS; k++) {
        let part = f32(k) / f32(TAPS);
        let n = max(k, u32(round(reach * part * part)));
        let pixels = here + i32(n) * step;
        if (any(pixels < vec2i(0)) || any(pixels >= vec2i(textureDimensions(source)))) {
            break;
        }
        let next = textureLoad(source, pixels, 0);
        let away = distance(place, place_of(pixels, next.a));
        half = 0.5 * pixel * f32(n - before);
        let joined = min(tap.a, next.a) > 0.0 && away > at && away - at <= 2.0 * STEEPEST * half;
        let middle = 0.5 * (at + away);
        let share = share_of_tap(tap, nearer, select(at + half, middle, joined));
        sum += share * tap.rgb;
        total += share;
        nearer = share_within(select(max(away - half, 0.0), middle, joined));
        tap = next;
        at = away;
        before = n;
    }
    let share = share_of_tap(tap, nearer, at + half);
    sum += share * tap.rgb;
    total += share;
    return sum * min(0.5 / max(total, vec3f(1e-6)), vec3f(1.0)) + max(0.5 - total, vec3f(0.0)) * centre.rgb;
}

// Share of the light from the distances that a tap covers, none from pixels without skin.
fn share_of_tap(tap: vec4f, nearer: vec3f, farthest: f32) -> vec3f {
    return select(vec3f(0.0), share_within(farthest) - nearer, tap.a > 0.0);
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
