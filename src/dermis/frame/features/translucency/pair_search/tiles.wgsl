// Bounding box and normal cone of each tile of the atlas, from the triangles clipped to the tile.
//#include "shape/geometry.wgsl"
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> triangle_first: array<u32>;
@group(0) @binding(4) var<storage, read> triangles: array<u32>;
@group(0) @binding(5) var<storage, read_write> tiles: array<Bounds>;

// Bounds of the part of a triangle that lies in a tile: its box, and normals at three or four corners.
struct ClippedTriangle {
    low: vec3f,
    high: vec3f,
    normals: array<vec3f, 4>,
}

// Within a rectangle of the atlas positions and normals are linear, so that its corners bound them.
fn clip_triangle(index: u32, tile_low: vec2f, tile_high: vec2f) -> ClippedTriangle {
    let t = triangle_at(index);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let third = bitcast<vec2f>(triangle_row(index, 2u).xy);
    let margin = vec2f(search.margin);
    let low_uv = min(min(ab.xy, ab.zw), third) - margin;
    let high_uv = max(max(ab.xy, ab.zw), third) + margin;
    let low = clamp(tile_low - margin, low_uv, high_uv);
    let high = clamp(tile_high + margin, low_uv, high_uv);
    var clipped: ClippedTriangle;
    clipped.low = min(min(a.position, b.position), c.position);
    clipped.high = max(max(a.position, b.position), c.position);
    clipped.normals = array<vec3f, 4>(a.normal, b.normal, c.normal, c.normal);
    let flat = mat2x2f(ab.zw - ab.xy, third - ab.xy);
    let area = determinant(flat);
    let size = high_uv - low_uv;
    let inner = high - low;
    if (inner.x * inner.y > 0.9 * size.x * size.y || abs(area) < 1e-3 * size.x * size.y) {
        return clipped;
    }
    var clipped_low = vec3f(FAR);
    var clipped_high = vec3f(-FAR);
    for (var k = 0u; k < 4u; k++) {
        let from_a = select(low, high, vec2<bool>((k & 1u) > 0u, (k & 2u) > 0u)) - ab.xy;
        let w = vec2f(determinant(mat2x2f(from_a, flat[1])), determinant(mat2x2f(flat[0], from_a))) / area;
        let position = a.position + w.x * (b.position - a.position) + w.y * (c.position - a.position);
        clipped_low = min(clipped_low, position);
        clipped_high = max(clipped_high, position);
        clipped.normals[k] = a.normal + w.x * (b.normal - a.normal) + w.y * (c.normal - a.normal);
    }
    clipped.low = max(clipped.low, clipped_low);
    clipped.high = min(clipped.high, clipped_high);
    return clipped;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let tile = list_index(group, groups, lane);
    if (tile >= search.count) {
        return;
    }
    let low = search.tile * vec2f(vec2u(tile % search.tiles, tile / search.tiles));
    let high = low + search.tile;
    let first = triangle_first[tile];
    let end = triangle_first[tile + 1u];
    var bounds = empty_bounds();
    for (var k = first; k < end; k++) {
        let clipped = clip_triangle(triangles[k], low, high);
        bounds.low = min(bounds.low, clipped.low);
        bounds.high = max(bounds.high, clipped.high);
        for (var c = 0u; c < 4u; c++) {
            bounds.axis += unit_or_zero(clipped.normals[c]);
        }
        bounds.occupied = 1u;
    }
    bounds.axis = unit_or_zero(bounds.axis);
    var cosine = 1.0;
    for (var k = first; k < end; k++) {
        let clipped = clip_triangle(triangles[k], low, high);
        for (var c = 0u; c < 4u; c++) {
            cosine = min(cosine, dot(bounds.axis, unit_or_zero(clipped.normals[c])));
        }
    }
    if (bounds.occupied > 0u) {
        bounds = with_cone(bounds, cosine);
    }
    tiles[tile] = bounds;
}
