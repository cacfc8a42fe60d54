// All the skin of a pixel together.

const ONE_SURFACE: f32 = 4.0; // largest change of depth over width within one surface, in a pixel
const CROSSED: f32 = 2.0; // step in depth that light below the skin crosses [mm]: still one surface

// The skin of one pixel, each member times the share of its samples.
struct PixelSkin {
    below: vec3f,
    leaving: vec3f,
    depth: f32,
    share: f32,
}

// Adds a part of a pixel to its skin; of several surfaces the one that most samples see is kept.
fn keep(held: PixelSkin, part: Shaded, share: f32, pixel: f32) -> PixelSkin {
    let one = PixelSkin(share * part.below, share * part.leaving, share * part.depth, share);
    let apart = abs(part.depth - held.depth / max(held.share, 1e-6));
    if (held.share > 0.0 && apart <= max(ONE_SURFACE * pixel * part.depth, CROSSED)) {
        return PixelSkin(held.below + one.below, held.leaving + one.leaving, held.depth + one.depth, held.share + share);
    }
    if (share > held.share) {
        return one;
    }
    return held;
}
