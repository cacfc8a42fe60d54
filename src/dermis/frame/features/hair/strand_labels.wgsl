// Labels of hairs, for passes that draw hairs with or without them.
//#if HAIR_LABELS
// The class of hairs that covers most of each pixel, where they cover at least half of it, in front of what its centre sees.
//#include "strand_fragments.wgsl"

//#fill const RIGHT_BROW: u32 = {class_right_brow};
//#fill const LEFT_BROW: u32 = {class_left_brow};
//#fill const HAIR: u32 = {class_hair};
//#fill const BEARD: u32 = {class_beard};
//#fill const LASHES: u32 = {class_lashes};
const HALF: u32 = 11356u; // of `dense_of`, where what is let through is half

@group(0) @binding(51) var centres: texture_2d_array<u32>; // triangle + 1 at the centre of each pixel
@group(0) @binding(56) var<storage, read> hair_classes: array<u32>; // of each hair
@group(0) @binding(57) var<storage, read_write> hair_labels: array<u32>; // a byte of all hairs, then one without lashes

// By class, the logarithm of what hairs let through: sums do not depend on the order of the hairs.
struct Dense {
    brows: vec2u, // right and left
    hair: u32,
    beard: u32,
    lashes: u32,
}

const NO_HAIRS = Dense(vec2u(0u), 0u, 0u, 0u);

fn dense_of(cover: f32) -> u32 {
    return u32(FIXED * -log(max(1.0 - cover, 1e-4)));
}

fn added(sum: Dense, kind: u32, much: u32) -> Dense {
    let none = vec2u(0u);
    return Dense(
        sum.brows + select(none, vec2u(much), vec2u(kind) == vec2u(RIGHT_BROW, LEFT_BROW)),
        sum.hair + select(0u, much, kind == HAIR),
        sum.beard + select(0u, much, kind == BEARD),
        sum.lashes + select(0u, much, kind == LASHES),
    );
}

// Class of most of the hairs, 0 where they cover too little.
fn class_of(sum: Dense) -> u32 {
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

// Of all hairs, then of those but lashes.
fn labels_of(sum: Dense) -> u32 {
    var bare = sum;
    bare.lashes = 0u;
    return class_of(sum) | class_of(bare) << 8u;
}

var<private> counted: Dense; // all 0 at first
var<private> surface: f32; // how deep it is

fn begin_labels(pixel: vec2u) {
    surface = 1e30;
    let found = textureLoad(centres, pixel, 0, 0).x;
    if (found > 0u) {
        surface = depth_at(found - 1u, vec2f(pixel) + 0.5);
    }
}

fn label_piece(one: Fragment) {
    if (one.cover > 0.0 && one.depth < surface) {
        counted = added(counted, hair_classes[hair_of_knot(one.begin)], dense_of(one.cover));
    }
}

var<workgroup> handed_labels: array<Dense, STRAND_TILE * STRAND_TILE>; // from one layer of a workgroup to another, see strand_team.wgsl

fn hand_labels_over(lane: u32) {
    handed_labels[lane] = counted;
}

fn take_labels_over(lane: u32) {
    let other = handed_labels[lane];
    counted.brows += other.brows;
    counted.hair += other.hair;
    counted.beard += other.beard;
    counted.lashes += other.lashes;
}

fn put_label(pixel: vec2u) {
    hair_labels[pixel.y * u32(strand_view.size.x) + pixel.x] = labels_of(counted);
    counted = NO_HAIRS; // for the next pixel
}
//#else
// No labels of hairs.

fn begin_labels(pixel: vec2u) {}

fn label_piece(one: Fragment) {}

fn put_label(pixel: vec2u) {}

fn hand_labels_over(lane: u32) {}

fn take_labels_over(lane: u32) {}
//#end
