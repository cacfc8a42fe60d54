// Current centres, normals and areas of sources: cells where light enters thin parts.
//#include "shape/geometry.wgsl"
//#include "translucent_pair.wgsl"
//#include "cells.wgsl"

@group(0) @binding(3) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(0) @binding(4) var<storage, read> sources: array<u32>; // cell
@group(0) @binding(5) var<storage, read_write> source_points: array<Source>;

const INSIDE: f32 = 0.1; // texels; gutter texels show a position that is farther from their own

struct CellSum {
    centre: vec3f,
    area: f32,
    nearest: f32, // distance of the texel from the middle of the cell [texel]
    normal: vec3f,
    texel: vec2u,
}

fn with_texel(sum: CellSum, at: vec2u, middle: vec2f) -> CellSum {
    let texel = textureLoad(atlas, at, 0);
    let index = max(texel.x, 1u) - 1u;
    let t = triangle_at(index);
    let w = unpack2x16unorm(texel.y);
    let weights = vec3f(1.0 - w.x - w.y, w);
    let offset = abs(f32(cells.size) * atlas_position(index, weights) - (vec2f(at) + 0.5));
    let inside = texel.x > 0u && max(offset.x, offset.y) < INSIDE;
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let surface = cross(b.position - a.position, c.position - a.position);
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let flat = determinant(mat2x2f(ab.zw - ab.xy, bitcast<vec2f>(triangle_row(index, 2u).xy) - ab.xy));
    let mm2 = select(0.0, length(surface) / max(abs(flat) * f32(cells.size * cells.size), 1e-9), inside);
    let distance_to_middle = distance(vec2f(at), middle);
    var result = sum;
    result.centre += mm2 * (weights.x * a.position + weights.y * b.position + weights.z * c.position);
    result.area += mm2;
    if (inside && distance_to_middle < sum.nearest) {
        result.nearest = distance_to_middle;
        result.normal = weights.x * a.normal + weights.y * b.normal + weights.z * c.normal;
        result.texel = at;
    }
    return result;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= cells.count) {
        return;
    }
    let cell = unpacked(sources[index]);
    let begin = cells.stride * ((first_texel(cell) + cells.stride - 1u) / cells.stride);
    let end = first_texel(cell + 1u);
    let middle = (vec2f(cell) + 0.5) * f32(cells.size) / f32(cells.side) - 0.5;
    var sum = CellSum(vec3f(0.0), 0.0, 1e9, vec3f(0.0), begin);
    for (var y = begin.y; y < end.y; y += cells.stride) {
        for (var x = begin.x; x < end.x; x += cells.stride) {
            sum = with_texel(sum, vec2u(x, y), middle);
        }
    }
    let normal = sum.normal * inverseSqrt(max(dot(sum.normal, sum.normal), 1e-30));
    let area = f32(cells.stride * cells.stride) * sum.area;
    source_points[index] = Source(sum.centre / max(sum.area, 1e-30), area, normal, packed(sum.texel));
}
