// Lists each piece of hair in the tiles of the picture that it may cover.
//#include "each.wgsl"
//#include "strand_view.wgsl"
//#include "strand_tiles.wgsl"

@group(0) @binding(30) var<storage, read> drawn: array<Drawn>;
@group(0) @binding(31) var<storage, read_write> chains: array<atomic<u32>>; // links in use, then the first link + 1 of each tile
@group(0) @binding(32) var<storage, read_write> links: array<vec2u>; // a piece, the next link + 1

fn list(piece: u32, tile: u32) {
    let link = atomicAdd(&chains[0], 1u);
    if (link < arrayLength(&links)) {
        links[link] = vec2u(piece, atomicExchange(&chains[1u + tile], link + 1u));
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let piece = number_of(group, groups, lane);
    if (piece >= strand_view.hairs * (KNOTS - 1u)) {
        return;
    }
    let begin = piece_begin(piece);
    let a = drawn[begin];
    let b = drawn[begin + 1u];
    if (a.width < 0.0 || b.width < 0.0) {
        return;
    }
    let side = f32(STRAND_TILE);
    let reach = vec2f(0.5 * max(max(a.width, b.width), 1.0) + 1.0);
    let low = max(floor((min(a.place, b.place) - reach) / side), vec2f(0.0));
    let last = ceil(strand_view.size / side) - 1.0;
    let high = min(floor((max(a.place, b.place) + reach) / side), last);
    let way = b.place - a.place;
    let far = reach.x + 0.7072 * side; // of a tile's middle that may be covered
    for (var y = low.y; y <= high.y; y += 1.0) {
        for (var x = low.x; x <= high.x; x += 1.0) {
            let middle = (vec2f(x, y) + 0.5) * side - a.place;
            let t = clamp(dot(middle, way) / max(dot(way, way), 1e-12), 0.0, 1.0);
            if (distance(middle, t * way) <= far) {
                list(piece, u32(y) * tiles_across(strand_view.size) + u32(x));
            }
        }
    }
}
