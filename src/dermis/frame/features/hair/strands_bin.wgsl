// Adds each segment to the lists of those tiles of the picture that it may cover.
//#include "each.wgsl"
//#include "strand_view.wgsl"
//#include "strand_tiles.wgsl"

@group(0) @binding(30) var<storage, read> projected: array<ProjectedKnot>;
@group(0) @binding(31) var<storage, read_write> list_heads: array<atomic<u32>>; // number of links in use, then the first link + 1 of each list
@group(0) @binding(32) var<storage, read_write> links: array<vec2u>; // packed segment, see strand_knots.wgsl, and the next link + 1

// A segment and the tiles around it.
struct TiledSegment {
    begin: vec2f, // [pixel]
    across: vec2f, // unit vector across it
    low: vec2f, // first and last tile of its bounding box
    high: vec2f,
    far: f32, // largest distance from the middle of a tile to its line at which it may cover the middle of a pixel of the tile [pixel]
}

fn tiled_segment(a: ProjectedKnot, b: ProjectedKnot) -> TiledSegment {
    let side = f32(STRAND_TILE);
    let reach = 0.5 * max(max(a.width, b.width), 1.0) + 0.5; // as in `fragment_of`
    let low = max(floor((min(a.position, b.position) - reach) / side), vec2f(0.0));
    let high = min(floor((max(a.position, b.position) + reach) / side), ceil(strand_view.size / side) - 1.0);
    let direction = b.position - a.position;
    let across = vec2f(-direction.y, direction.x) / max(length(direction), 1e-6);
    return TiledSegment(a.position, across, low, high, reach + 0.5 * (side - 1.0) * (abs(across.x) + abs(across.y)));
}

// First and last tile of a row that the segment may cover; the last is before the first if there is none.
fn covered_tiles(segment: TiledSegment, y: f32) -> vec2f {
    let side = f32(STRAND_TILE);
    let slope = side * segment.across.x;
    let offset = dot(vec2f(0.5 * side, (y + 0.5) * side) - segment.begin, segment.across); // of the first tile of the row
    if (abs(slope) < 1e-3 * side) {
        return select(vec2f(1.0, 0.0), vec2f(segment.low.x, segment.high.x), abs(offset) <= segment.far);
    }
    let ends = (vec2f(-segment.far, segment.far) - offset) / slope;
    return vec2f(max(segment.low.x, ceil(min(ends.x, ends.y))), min(segment.high.x, floor(max(ends.x, ends.y))));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let segment = list_index(group, groups, lane);
    if (segment >= segment_count(strand_view.coarse)) {
        return;
    }
    let hair = hair_of_segment(segment);
    let begin = segment + hair;
    let a = projected[begin];
    let b = projected[begin + 1u];
    if (a.width < 0.0 || b.width < 0.0 || a.covered != 0u) {
        return;
    }
    let one = tiled_segment(a, b);
    var count = 0u; // counted first, for a single atomic operation per segment
    for (var y = one.low.y; y <= one.high.y; y += 1.0) {
        let tiles = covered_tiles(one, y);
        count += u32(max(tiles.y - tiles.x + 1.0, 0.0));
    }
    if (count == 0u) {
        return;
    }
    var link = atomicAdd(&list_heads[0], count);
    for (var y = one.low.y; y <= one.high.y; y += 1.0) {
        let tiles = covered_tiles(one, y);
        for (var x = tiles.x; x <= tiles.y && link < arrayLength(&links); x += 1.0) {
            let tile = u32(y) * tiles_across(strand_view.size) + u32(x);
            links[link] = vec2u(pack_segment(begin, hair), atomicExchange(&list_heads[1u + tile], link + 1u));
            link += 1u;
        }
    }
}
