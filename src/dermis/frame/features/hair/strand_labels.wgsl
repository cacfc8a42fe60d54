// Labels of hair, for passes that draw strands with or without labels.
//#if HAIR_LABELS
// Class of the strands that cover most of each pixel, where strands cover at least half of it in front of the surface, and
// the fraction of the pixel that they cover.
//#include "strand_fragments.wgsl"

//#fill const RIGHT_BROW: u32 = {class_right_brow};
//#fill const LEFT_BROW: u32 = {class_left_brow};
//#fill const HAIR: u32 = {class_hair};
//#fill const BEARD: u32 = {class_beard};
//#fill const LASHES: u32 = {class_lashes};
const HALF: u32 = 11356u; // `negative_log` of a cover of one half

@group(0) @binding(51) var centres: texture_2d_array<u32>; // triangle + 1 at the centre of each pixel
@group(0) @binding(56) var<storage, read> hair_classes: array<u32>; // of each strand
@group(0) @binding(57) var<storage, read_write> hair_labels: array<u32>; // bytes: class of all strands, class of all but lashes, cover by hair and beard, cover by all strands

// Negative logarithm of the transmittance by class, in integers whose sum does not depend on the order.
struct ClassSums {
    brows: vec2u, // right and left
    hair: u32,
    beard: u32,
    lashes: u32,
}

const NO_HAIRS = ClassSums(vec2u(0u), 0u, 0u, 0u);

fn negative_log(cover: f32) -> u32 {
    return u32(FIXED_POINT * -log(max(1.0 - cover, 1e-4)));
}

fn add_class(sum: ClassSums, kind: u32, amount: u32) -> ClassSums {
    let none = vec2u(0u);
    return ClassSums(
        sum.brows + select(none, vec2u(amount), vec2u(kind) == vec2u(RIGHT_BROW, LEFT_BROW)),
        sum.hair + select(0u, amount, kind == HAIR),
        sum.beard + select(0u, amount, kind == BEARD),
        sum.lashes + select(0u, amount, kind == LASHES),
    );
}

// Class with the most cover, 0 where strands cover less than half.
fn class_of(sum: ClassSums) -> u32 {
    let brow = max(sum.brows.x, sum.brows.y);
    if (sum.brows.x + sum.brows.y + sum.hair + sum.beard + sum.lashes < HALF) {
        return 0u;
    }
    let most = max(max(sum.hair, sum.beard), max(brow, sum.lashes));
    if (most == sum.hair) {
        return HAIR;
    }
    if (most == sum.beard) {
        return BEARD;
    }
    if (most == sum.lashes) {
        return LASHES;
    }
    return select(LEFT_BROW, RIGHT_BROW, most == sum.brows.x);
}

// Fraction of a pixel that strands cover, as a byte.
fn cover_byte(sum: u32) -> u32 {
    return u32(round(255.0 * (1.0 - exp(-f32(sum) / FIXED_POINT))));
}

// Label of all strands, label of all but lashes, cover by hair and beard, and cover by all strands; a byte each.
fn labels_of(sum: ClassSums) -> u32 {
    var without_lashes = sum;
    without_lashes.lashes = 0u;
    let occluders = sum.hair + sum.beard;
    let all = occluders + sum.brows.x + sum.brows.y + sum.lashes;
    return class_of(sum) | class_of(without_lashes) << 8u | cover_byte(occluders) << 16u | cover_byte(all) << 24u;
}

var<private> class_sums: ClassSums; // initially 0
var<private> surface_depth: f32; // depth [mm]

fn begin_labels(pixel: vec2u) {
    surface_depth = 1e30;
    let triangle = textureLoad(centres, pixel, 0, 0).x;
    if (triangle > 0u) {
        surface_depth = depth_at(triangle - 1u, vec2f(pixel) + 0.5);
    }
}

fn label_fragment(one: Fragment) {
    if (one.cover > 0.0 && one.depth < surface_depth) {
        class_sums = add_class(class_sums, hair_classes[hair_of_knot(one.begin)], negative_log(one.cover));
    }
}

fn store_label(pixel: vec2u) {
    hair_labels[pixel.y * u32(strand_view.size.x) + pixel.x] = labels_of(class_sums);
    class_sums = NO_HAIRS; // for the next pixel
}
//#else
// Without labels of hair.

fn begin_labels(pixel: vec2u) {}

fn label_fragment(one: Fragment) {}

fn store_label(pixel: vec2u) {}
//#end
