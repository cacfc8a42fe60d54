// The image: every sample of the visibility buffer shaded, those of a pixel that see one triangle together.
//#include "shading.wgsl"
//#include "sample_bits.wgsl"
//#include "pixel_skin.wgsl"

// Pixels of an invocation, one below the other. Software adapters run a branch for all lanes of a vector as long as one of
// them needs it: with a strip, each lane goes on to its next pixel that sees the head when it is done with one.
override STRIP: u32 = 1u;

@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>; // triangle + 1 of each sample
@group(0) @binding(33) var image: texture_storage_2d<rgba32float, write>;
@group(0) @binding(34) var apart: texture_storage_2d_array<rgba32float, write>; // light below, depth; share of it that leaves

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
        let met = met_at(part.triangle, part.place, part.share, vec2f(size));
        let one = shaded(met, lit_at(met));
        pixel.sum += part.share * vec4f(one.below * one.leaving + (one.reflected + one.still), 1.0);
        if (SPLIT && one.depth > 0.0) {
            pixel.skin = keep(pixel.skin, one, part.share, 2.0 * length(shade.up) / f32(size.y));
        }
        part = find(&pixel, end);
        if (part.share == 0.0) {
            break;
        }
    }
}
