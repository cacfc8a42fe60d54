// What each tile of the atlas shows: a box around the parts of triangles in it, and a cone around their normals.
//#include "shape/geometry.wgsl"
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> triangle_first: array<u32>;
@group(0) @binding(4) var<storage, read> triangles: array<u32>;
@group(0) @binding(5) var<storage, read_write> tiles: array<Bounds>;

// Four places, or three, around the part of a triangle that a tile shows.
struct Part {
    low: vec3f,
    high: vec3f,
    normals: array<vec3f, 4>,
}

// Between the corners of a rectangle of the map positions and normals are between those there.
fn part_of(index: u32, tile_low: vec2f, tile_high: vec2f) -> Part {
    let t = triangle_at(index);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let third = bitcast<vec2f>(triangle_row(index, 2u).xy);
    let beside = vec2f(search.beside);
    let least = min(min(ab.xy, ab.zw), third) - beside;
    let most = max(max(ab.xy, ab.zw), third) + beside;
    let low = clamp(tile_low - beside, least, most);
    let high = clamp(tile_high + beside, least, most);
    var part: Part;
    part.low = min(min(a.position, b.position), c.position);
    part.high = max(max(a.position, b.position), c.position);
    part.normals = array<vec3f, 4>(a.normal, b.normal, c.normal, c.normal);
    let flat = mat2x2f(ab.zw - ab.xy, third - ab.xy);
    let area = determinant(flat);
    let size = most - least;
    let inner = high - low;
    if (inner.x * inner.y > 0.9 * size.x * size.y || abs(area) < 1e-3 * size.x * size.y) {
        return part;
    }
    var lowest = vec3f(FAR);
    var highest = vec3f(-FAR);
    for (var k = 0u; k < 4u; k++) {
        let from_a = select(low, high, vec2<bool>((k & 1u) > 0u, (k & 2u) > 0u)) - ab.xy;
        let w = vec2f(determinant(mat2x2f(from_a, flat[1])), determinant(mat2x2f(flat[0], from_a))) / area;
        let place = a.position + w.x * (b.position - a.position) + w.y * (c.position - a.position);
        lowest = min(lowest, place);
        highest = max(highest, place);
        part.normals[k] = a.normal + w.x * (b.normal - a.normal) + w.y * (c.normal - a.normal);
    }
    part.low = max(part.low, lowest);
    part.high = min(part.high, highest);
    return part;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let tile = number_of(group, groups, lane);
    if (tile >= search.count) {
        return;
    }
    let low = search.tile * vec2f(vec2u(tile % search.tiles, tile / search.tiles));
    let high = low + search.tile;
    let first = triangle_first[tile];
    let end = triangle_first[tile + 1u];
    var made = nothing();
    for (var k = first; k < end; k++) {
        let part = part_of(triangles[k], low, high);
        made.low = min(made.low, part.low);
        made.high = max(made.high, part.high);
        for (var c = 0u; c < 4u; c++) {
            made.axis += unit_or_zero(part.normals[c]);
        }
        made.any = 1u;
    }
    made.axis = unit_or_zero(made.axis);
    var cosine = 1.0;
    for (var k = first; k < end; k++) {
        let part = part_of(triangles[k], low, high);
        for (var c = 0u; c < 4u; c++) {
            cosine = min(cosine, dot(made.axis, unit_or_zero(part.normals[c])));
        }
    }
    if (made.any > 0u) {
        made = coned(made, cosine);
    }
    tiles[tile] = made;
}
