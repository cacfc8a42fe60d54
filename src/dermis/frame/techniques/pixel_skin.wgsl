// Combines the skin in all samples of a pixel.

const MAX_SLOPE: f32 = 4.0; // largest ratio of a change of depth to the width within one surface
const MAX_STEP: f32 = 2.0; // step in depth that light below the skin can cross [mm]

// Skin of a pixel; the other members are multiplied by its coverage.
struct PixelSkin {
    below: vec3f,
    leaving: vec3f,
    depth: f32,
    coverage: f32,
}

// Adds samples to the skin of a pixel; of several surfaces the one with most samples is kept.
fn add_samples(skin_so_far: PixelSkin, part: Shaded, coverage: f32, pixel: f32) -> PixelSkin {
    let one = PixelSkin(coverage * part.below, coverage * part.leaving, coverage * part.depth, coverage);
    let step = abs(part.depth - skin_so_far.depth / max(skin_so_far.coverage, 1e-6));
    if (skin_so_far.coverage > 0.0 && step <= max(MAX_SLOPE * pixel * part.depth, MAX_STEP)) {
        return PixelSkin(skin_so_far.below + one.below, skin_so_far.leaving + one.leaving, skin_so_far.depth + one.depth, skin_so_far.coverage + coverage);
    }
    if (coverage > skin_so_far.coverage) {
        return one;
    }
    return skin_so_far;
}
