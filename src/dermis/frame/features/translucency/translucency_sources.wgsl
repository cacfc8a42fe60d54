// Where the cells of the atlas that give light to thin parts lie now, and how much surface they hold.
//#include "shape/geometry.wgsl"
//#include "translucent_pair.wgsl"
//#include "cells.wgsl"

@group(0) @binding(3) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(0) @binding(4) var<storage, read> sources: array<u32>; // cell
@group(0) @binding(5) var<storage, read_write> source_points: array<Source>;

const INSIDE: f32 = 0.1; // texels; the place of a texel beside a chart is on its edge, or in another chart

struct Shown {
    centre: vec3f,
    area: f32,
    nearest: f32, // texels from the cell's middle
    normal: vec3f,
    texel: vec2u,
}

fn with_texel(shown: Shown, at: vec2u, middle: vec2f) -> Shown {
    let texel = textureLoad(atlas, at, 0);
    let index = max(texel.x, 1u) - 1u;
    let t = triangle_at(index);
    let w = unpack2x16unorm(texel.y);
    let weights = vec3f(1.0 - w.x - w.y, w);
    let off = abs(f32(cells.size) * place_of_point(index, weights) - (vec2f(at) + 0.5));
    let inside = texel.x > 0u && max(off.x, off.y) < INSIDE;
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let surface = cross(b.position - a.position, c.position - a.position);
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let flat = determinant(mat2x2f(ab.zw - ab.xy, bitcast<vec2f>(triangle_row(index, 2u).xy) - ab.xy));
    let mm2 = select(0.0, length(surface) / max(abs(flat) * f32(cells.size * cells.size), 1e-9), inside);
    let away = distance(vec2f(at), middle);
    var made = shown;
    made.centre += mm2 * (weights.x * a.position + weights.y * b.position + weights.z * c.position);
    made.area += mm2;
    if (inside && away < shown.nearest) {
        made.nearest = away;
        made.normal = weights.x * a.normal + weights.y * b.normal + weights.z * c.normal;
        made.texel = at;
    }
    return made;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= cells.count) {
        return;
    }
    let cell = unpacked(sources[index]);
    let begin = cells.stride * ((first_of(cell) + cells.stride - 1u) / cells.stride);
    let end = first_of(cell + 1u);
    let middle = (vec2f(cell) + 0.5) * f32(cells.size) / f32(cells.side) - 0.5;
    var shown = Shown(vec3f(0.0), 0.0, 1e9, vec3f(0.0), begin);
    for (var y = begin.y; y < end.y; y += cells.stride) {
        for (var x = begin.x; x < end.x; x += cells.stride) {
            shown = with_texel(shown, vec2u(x, y), middle);
        }
    }
    let normal = shown.normal * inverseSqrt(max(dot(shown.normal, shown.normal), 1e-30));
    let area = f32(cells.stride * cells.stride) * shown.area;
    source_points[index] = Source(shown.centre / max(shown.area, 1e-30), area, normal, packed(shown.texel));
}
