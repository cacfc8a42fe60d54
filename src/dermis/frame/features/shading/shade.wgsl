// Shades every sample of the visibility buffer; samples of a pixel that see the same triangle are shaded together.
//#include "shading.wgsl"
//#include "sample_bits.wgsl"
//#include "pixel_skin.wgsl"

// Pixels of a column that an invocation shades. Software adapters run a branch for all lanes of a vector while one needs it: with
// a strip, each lane continues with its next pixel that sees the head.
override STRIP: u32 = 1u;

@group(0) @binding(31) var visibility_buffer: texture_2d_array<u32>; // triangle + 1 of each sample
@group(0) @binding(33) var image: texture_storage_2d<rgba32float, write>;
@group(0) @binding(34) var subsurface: texture_storage_2d_array<rgba32float, write>; // light below the skin, depth; fraction of it that leaves

// Samples of a pixel that see the same triangle.
struct SampleGroup {
    triangle: u32,
    position: vec2f, // in the image
    coverage: f32, // fraction of the pixel; 0 for no surface
}

// A pixel being shaded.
struct Pixel {
    at: vec2u,
    remaining: vec2u, // samples that are not yet shaded
    sum: vec4f, // radiance and coverage
    skin: PixelSkin,
}

fn pixel_at(at: vec2u) -> Pixel {
    return Pixel(at, samples_of(shade.samples), vec4f(0.0), PixelSkin(vec3f(0.0), vec3f(0.0), 0.0, 0.0));
}

// Next group of samples that see the same triangle: its maps are filtered over their fraction of the pixel.
fn next_group(pixel: ptr<function, Pixel>) -> SampleGroup {
    let at = (*pixel).at;
    var remaining = (*pixel).remaining;
    var s = select(32u + firstTrailingBit(remaining.y), firstTrailingBit(remaining.x), remaining.x != 0u);
    let triangle = textureLoad(visibility_buffer, at, s, 0).x;
    var position = vec2f(0.0);
    var n = 0u;
    loop {
        if (textureLoad(visibility_buffer, at, s, 0).x == triangle) {
            position += shade.jitter[s].xy;
            n++;
            remaining &= ~bit_of(s);
        }
        s++;
        if (s >= shade.samples) {
            break;
        }
    }
    (*pixel).remaining = remaining;
    let coverage = select(0.0, f32(n) / f32(shade.samples), triangle > 0u);
    return SampleGroup(triangle - 1u, vec2f(at) + position / f32(n), coverage);
}

// Next group that sees the head, in this pixel or further down the strip; completed pixels are stored.
fn find_group(pixel: ptr<function, Pixel>, end: u32) -> SampleGroup {
    loop {
        if (all((*pixel).remaining == vec2u(0u))) {
            finish(*pixel);
            *pixel = pixel_at((*pixel).at + vec2u(0u, 1u));
            if ((*pixel).at.y >= end) {
                break;
            }
        }
        let group = next_group(pixel);
        if (group.coverage > 0.0) {
            return group;
        }
    }
    return SampleGroup(0u, vec2f(0.0), 0.0);
}

fn finish(pixel: Pixel) {
    var sum = pixel.sum;
    if (SPLIT) {
        // The light of the main surface is removed here and added after its diffusion; that of lesser surfaces stays in place.
        let skin = pixel.skin;
        let held = max(skin.coverage, 1e-6);
        sum -= vec4f(skin.below * skin.leaving / held, 0.0);
        textureStore(subsurface, pixel.at, 0, vec4f(skin.below, skin.depth) / held);
        textureStore(subsurface, pixel.at, 1, vec4f(skin.leaving, 0.0));
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
    var group = find_group(&pixel, end);
    if (group.coverage == 0.0) {
        return; // no pixel of the strip sees the head
    }
    loop {
        let shading_point = shading_point_at(group.triangle, group.position, group.coverage, vec2f(size));
        let one = shaded(shading_point, lit_at(shading_point));
        pixel.sum += group.coverage * vec4f(one.below * one.leaving + (one.reflected + one.local), 1.0);
        if (SPLIT && one.depth > 0.0) {
            pixel.skin = add_samples(pixel.skin, one, group.coverage, 2.0 * length(shade.up) / f32(size.y));
        }
        group = find_group(&pixel, end);
        if (group.coverage == 0.0) {
            break;
        }
    }
}
