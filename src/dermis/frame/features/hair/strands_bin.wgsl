// Lists each piece of hair in the tiles of the picture that it may cover.
//#include "each.wgsl"
//#include "strand_view.wgsl"
//#include "strand_tiles.wgsl"

@group(0) @binding(30) var<storage, read> drawn: array<Drawn>;
@group(0) @binding(31) var<storage, read_write> chains: array<atomic<u32>>; // links in use, then the first link + 1 of each chain
@group(0) @binding(32) var<storage, read_write> links: array<vec2u>; // a piece, see strand_knots.wgsl, and the next link + 1

// A piece on its way through the tiles.
struct Piece {
    begin: vec2f, // [pixel]
    across: vec2f, // unit
    low: vec2f, // tiles that it may cover, first and last
    high: vec2f,
    far: f32, // distance from the middle of a tile within which its line may cover some of that [pixel]
}

fn piece_of(a: Drawn, b: Drawn) -> Piece {
    let side = f32(STRAND_TILE);
    let reach = 0.5 * max(max(a.width, b.width), 1.0) + 1.0;
    let low = max(floor((min(a.place, b.place) - reach) / side), vec2f(0.0));
    let high = min(floor((max(a.place, b.place) + reach) / side), ceil(strand_view.size / side) - 1.0);
    let way = b.place - a.place;
    let across = vec2f(-way.y, way.x) / max(length(way), 1e-6);
    return Piece(a.place, across, low, high, reach + 0.5 * side * (abs(across.x) + abs(across.y)));
}

// Of the tiles from `low` to `high`, which all lie along it.
fn covers(piece: Piece, tile: vec2f) -> bool {
    return abs(dot((tile + 0.5) * f32(STRAND_TILE) - piece.begin, piece.across)) <= piece.far;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let piece = number_of(group, groups, lane);
    if (piece >= pieces_of(strand_view.coarse)) {
        return;
    }
    let hair = hair_of_piece(piece);
    let begin = piece + hair;
    let a = drawn[begin];
    let b = drawn[begin + 1u];
    if (a.width < 0.0 || b.width < 0.0) {
        return;
    }
    let one = piece_of(a, b);
    var count = 0u; // first, so that there is one place that all pieces count at only once
    for (var y = one.low.y; y <= one.high.y; y += 1.0) {
        for (var x = one.low.x; x <= one.high.x; x += 1.0) {
            count += u32(covers(one, vec2f(x, y)));
        }
    }
    if (count == 0u) {
        return;
    }
    var link = atomicAdd(&chains[0], count);
    for (var y = one.low.y; y <= one.high.y; y += 1.0) {
        for (var x = one.low.x; x <= one.high.x; x += 1.0) {
            if (link < arrayLength(&links) && covers(one, vec2f(x, y))) {
                let tile = u32(y) * tiles_across(strand_view.size) + u32(x);
                links[link] = vec2u(listed_piece(begin, hair), atomicExchange(&chains[1u + tile * WAYS + piece % WAYS], link + 1u));
                link += 1u;
            }
        }
    }
}
