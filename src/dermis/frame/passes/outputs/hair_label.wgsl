// The class of the hairs over each pixel, where they cover at least half of it.
//#include "strand_fragments.wgsl"

override ROWS: u32 = 1u; // pixels of an invocation, one below the other; see `rows_of`

//#fill const RIGHT_BROW: u32 = {class_right_brow};
//#fill const LEFT_BROW: u32 = {class_left_brow};
//#fill const HAIR: u32 = {class_hair};
//#fill const BEARD: u32 = {class_beard};
//#fill const LASHES: u32 = {class_lashes};
const HALF: u32 = 11356u; // of `dense_of`, where what is let through is half

@group(0) @binding(31) var<storage, read> chains: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;
@group(0) @binding(56) var<storage, read> hair_classes: array<u32>; // of each hair
@group(0) @binding(57) var<storage, read_write> hair_labels: array<u32>; // a byte of all hairs, then one without lashes

// By class, the logarithm of what hairs let through: sums do not depend on the order of the hairs.
struct Dense {
    brows: vec2u, // right and left
    hair: u32,
    beard: u32,
    lashes: u32,
}

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

fn chain_of(pixel: vec2u, way: u32) -> u32 {
    let tile = pixel.y / STRAND_TILE * tiles_across(strand_view.size) + pixel.x / STRAND_TILE;
    return chains[1u + tile * WAYS + way];
}

fn label_at(pixel: vec2u) -> u32 {
    let depths = depths_at(pixel);
    var sum = Dense(vec2u(0u), 0u, 0u, 0u);
    for (var way = 0u; way < WAYS; way += 1u) {
        for (var link = chain_of(pixel, way); link != 0u; link = links[link - 1u].y) {
            let one = fragment_of(vec2f(pixel) + 0.5, hold(links[link - 1u].x));
            if (one.cover > 0.0 && one.depth < depths.first.x) {
                sum = added(sum, hair_classes[hair_of_knot(one.begin)], dense_of(one.cover));
            }
        }
    }
    var bare = sum;
    bare.lashes = 0u;
    return class_of(sum) | class_of(bare) << 8u;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2u(strand_view.size);
    let first = vec2u(id.x, id.y * ROWS);
    if (any(first >= size)) {
        return;
    }
    let end = min(first.y + ROWS, size.y);
    for (var y = first.y; y < end; y += 1u) {
        hair_labels[y * size.x + id.x] = label_at(vec2u(id.x, y));
    }
}
