// The image: light scattered below the skin, relit at its finest level, under the white lobe of the surface.
//#include "lighting.wgsl"
//#include "mouth.wgsl"
//#include "open_sky.wgsl"
//#include "lids.wgsl"
//#include "footprint.wgsl"
//#include "pre_integrated.wgsl"
//#include "sample_bits.wgsl"
//#include "shaded.wgsl"

override SPLIT: bool = false; // whether light below the skin is kept apart, to spread over the picture
// Pixels of an invocation, one below the other. Software adapters run a branch for all lanes of a vector as long as one of
// them needs it: with a strip, each lane goes on to its next pixel that sees the head when it is done with one.
override STRIP: u32 = 1u;

override EYES: bool = false; // whether there are eyes of true shape, and teeth

const WET_ROUGHNESS: f32 = 0.1; // of plain materials: teeth, tongues, eyeballs of files

struct Shade {
    eye: vec3f,
    samples: u32,
    forward: vec3f,
    right: vec3f, // scaled so that forward + (x + shift) right + (y + shift) up spans the image for x, y in -1..1
    up: vec3f,
    shift: vec2f, // of the picture's middle from the axis
    relit: vec3f, // weight of the level that is not blurred
    total: vec3f, // weight of all levels
    shown: vec2f, // factors of the light from below and of the reflected light
    pre: PreIntegrated,
    eyes: array<Eye, 2>,
    lids: array<vec4f, 112>, // edges of the lids around each eye, in its own space, half of them each; see human/lid_rings.csv
    material_colour: array<vec4f, 64>,
    jitter: array<vec4f, 64>, // sample places in the pixel, 0..1
}

@group(0) @binding(30) var<uniform> shade: Shade;
@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>; // triangle + 1 of each sample
@group(0) @binding(32) var scattered: texture_2d<f32>; // light on the atlas, blurred and combined; or pre-integrated tables
@group(0) @binding(33) var image: texture_storage_2d<rgba32float, write>;
@group(0) @binding(34) var apart: texture_storage_2d_array<rgba32float, write>; // light below, depth; share of it that leaves

fn shaded_skin(point: Point, surface: Surface, lit: Lit, out: f32, footprint: f32, open: f32) -> Shaded {
    let share = share_of(surface.colour, skin.mix);
    var below = lit.entered * share;
    if (PRE_INTEGRATED) {
        below = shade.total * pre_integrated(point, surface, footprint, open) * share;
    } else if ((point.flags & MAPPED) != 0u) {
        below = shade.relit * below + load_bilinear(scattered, point.place).rgb;
    } else {
        below *= shade.total;
    }
    var over = shade.shown.y * lit.reflected * mix(vec3f(1.0), surface.colour, skin.tint);
    var leaving = shade.shown.x * out * share_of(surface.colour, 1.0 - skin.mix);
    if (HALF_SPACE) {
        // Light above the mean has scattered once and is not blurred: at grazing angles it is many times the rest, and
        // blurred light from around must not be multiplied by it.
        let beyond = directional_share(lit, shade.total * share, below);
        over += below * leaving * max(beyond, vec3f(0.0));
        leaving *= 1.0 + min(beyond, vec3f(0.0));
    }
    return Shaded(below, leaving, over, dot(point.position - shade.eye, shade.forward));
}

fn shaded_plain(surface: Surface, lit: Lit, out: f32) -> Shaded {
    let below = lit.entered * surface.colour * out;
    return Shaded(vec3f(0.0), vec3f(0.0), shade.shown.x * below + shade.shown.y * lit.reflected, 0.0);
}

fn ray_through(place: vec2f, size: vec2f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * place / size + vec2f(-1.0, 1.0);
    return shade.forward + (ndc.x + shade.shift.x) * shade.right + (ndc.y + shade.shift.y) * shade.up;
}

// share: part of the pixel that is shaded at once; maps are filtered over it.
fn shaded(triangle: u32, place: vec2f, share: f32, size: vec2f) -> Shaded {
    let t = triangle_at(triangle);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let weights = ray_to_weights(shade.eye, a.position, b.position, c.position);
    let w = meet(weights, ray_through(place, size));
    let inside = within(w); // a sample on an edge may lie a little outside
    var point = interpolate(a, b, c, inside, t.w);
    point.place = place_of_point(triangle, inside);
    point.curvature = curvature_at(t, inside);
    let open = open_sky(point, t, inside);
    let v = normalize(shade.eye - point.position);
    let opaque = (t.w & OPAQUE) != 0u;
    let spacing = sqrt(share);
    let wx = meet(weights, ray_through(place + vec2f(spacing, 0.0), size)) - w;
    let wy = meet(weights, ray_through(place + vec2f(0.0, spacing), size)) - w;
    let footprint = footprint_of(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv, wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
    var surface: Surface;
    if (opaque) {
        surface = Surface(point.normal, shade.material_colour[point.flags >> 8u].rgb, WET_ROUGHNESS, 1.0);
    } else {
        surface = surface_at(point, footprint);
    }
    var film = Film(surface.normal, vec3f(0.0));
    if (EYES) {
        // A loop, because software adapters run both sides of a branch for all pixels, and a loop only while one needs it.
        var k = 0u;
        loop {
            if (!opaque || k >= 2u) {
                break;
            }
            let material = shade.material_colour[point.flags >> 8u];
            if (material.w > 0.0) {
                surface = mouth_at(point, material);
                film = Film(surface.normal, MOUTH_SCATTERED);
                break;
            }
            if (shade.eyes[k].material == (point.flags >> 8u)) {
                let own = (shade.eyes[k].to_own * vec4f(point.position, 1.0)).xyz;
                let eye = eye_at(shade.eyes[k], own, lids_around(k, own), v);
                surface = eye.surface;
                film = eye.film;
                point.lit_position += SCATTERED_MM * film.normal;
                break;
            }
            k++;
        }
    }
    // Called once: software adapters run both sides of a branch for all pixels.
    let lit = light_through(point, surface, film, v, open);
    let out = leaves(dot(film.normal, v), surface.roughness, surface.rho_s) / PI;
    if (opaque) {
        return shaded_plain(surface, lit, out);
    }
    return shaded_skin(point, surface, lit, out, footprint, open);
}

// Samples of a pixel that see the same triangle.
struct Part {
    triangle: u32,
    place: vec2f, // in the image
    share: f32, // of the pixel; 0 for nothing
}

// A pixel being shaded.
struct Pixel {
    at: vec2u,
    left: vec2u, // samples that have not been shaded
    sum: vec4f, // radiance and coverage
    skin: PixelSkin,
}

fn pixel_at(at: vec2u) -> Pixel {
    return Pixel(at, samples_of(shade.samples), vec4f(0.0), PixelSkin(vec3f(0.0), vec3f(0.0), 0.0, 0.0));
}

// Samples that see one triangle are shaded together: its maps are filtered over their part of the pixel.
fn next_part(pixel: ptr<function, Pixel>) -> Part {
    let at = (*pixel).at;
    var left = (*pixel).left;
    var s = select(32u + firstTrailingBit(left.y), firstTrailingBit(left.x), left.x != 0u);
    let triangle = textureLoad(visibility_buffer, at, s, 0).x;
    var place = vec2f(0.0);
    var n = 0u;
    loop {
        if (textureLoad(visibility_buffer, at, s, 0).x == triangle) {
            place += shade.jitter[s].xy;
            n++;
            left &= ~bit_of(s);
        }
        s++;
        if (s >= shade.samples) {
            break;
        }
    }
    (*pixel).left = left;
    let share = select(0.0, f32(n) / f32(shade.samples), triangle > 0u);
    return Part(triangle - 1u, vec2f(at) + place / f32(n), share);
}

// The next part that sees the head, in this pixel or further down the strip; pixels left behind are finished.
fn find(pixel: ptr<function, Pixel>, end: u32) -> Part {
    loop {
        if (all((*pixel).left == vec2u(0u))) {
            finish(*pixel);
            *pixel = pixel_at((*pixel).at + vec2u(0u, 1u));
            if ((*pixel).at.y >= end) {
                break;
            }
        }
        let part = next_part(pixel);
        if (part.share > 0.0) {
            return part;
        }
    }
    return Part(0u, vec2f(0.0), 0.0);
}

fn finish(pixel: Pixel) {
    var sum = pixel.sum;
    if (SPLIT) {
        // The light taken out here comes back spread; that of the pixel's lesser surfaces stays where it is.
        let skin = pixel.skin;
        let held = max(skin.share, 1e-6);
        sum -= vec4f(skin.below * skin.leaving / held, 0.0);
        textureStore(apart, pixel.at, 0, vec4f(skin.below, skin.depth) / held);
        textureStore(apart, pixel.at, 1, vec4f(skin.leaving, 0.0));
    }
    textureStore(image, pixel.at, sum);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(image);
    let first = vec2u(id.x, id.y * STRIP);
    if (any(first >= size)) {
        return;
    }
    let end = min(first.y + STRIP, size.y);
    var pixel = pixel_at(first);
    var part = find(&pixel, end);
    if (part.share == 0.0) {
        return; // no pixel of the strip sees the head
    }
    loop {
        let one = shaded(part.triangle, part.place, part.share, vec2f(size));
        pixel.sum += part.share * vec4f(one.below * one.leaving + one.over, 1.0);
        if (SPLIT && one.depth > 0.0) {
            pixel.skin = keep(pixel.skin, one, part.share, 2.0 * length(shade.up) / f32(size.y));
        }
        part = find(&pixel, end);
        if (part.share == 0.0) {
            break;
        }
    }
}
