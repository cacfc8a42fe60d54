// Current positions of receivers: the centres of cells where light leaves thin parts.
//#include "shape/geometry.wgsl"
//#include "translucent_pair.wgsl"
//#include "cells.wgsl"

override FACETS: bool = false; // whether the metric is that of the triangle, or that of the stretch map

@group(0) @binding(3) var stretch_map: texture_2d<f32>; // texels per mm along u and v; cosine of the angle between them
@group(0) @binding(4) var<storage, read> receivers: array<vec4u>; // triangle, packed barycentric weights, cell
@group(0) @binding(5) var<storage, read_write> receiver_points: array<Receiver>;

// First fundamental form per texel: E, G and F [mm^2].
fn metric_at(texel: vec2u) -> vec3f {
    let stretch = textureLoad(stretch_map, texel, 0).xyz;
    let mm = 1.0 / max(stretch.xy, vec2f(1e-6));
    return vec3f(mm * mm, stretch.z * mm.x * mm.y);
}

// The metric of a triangle, by its corners on the surface and in the atlas.
fn triangle_metric(index: u32, along: mat2x3f) -> vec3f {
    let ab = bitcast<vec4f>(triangle_row(index, 1u));
    let b = f32(cells.size) * (ab.zw - ab.xy);
    let c = f32(cells.size) * (bitcast<vec2f>(triangle_row(index, 2u).xy) - ab.xy);
    let area = b.x * c.y - b.y * c.x;
    let scale = select(0.0, 1.0 / area, abs(area) > 1e-6);
    let u = scale * (c.y * along[0] - b.y * along[1]);
    let v = scale * (b.x * along[1] - c.x * along[0]);
    return vec3f(dot(u, u), dot(v, v), dot(u, v));
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
    let receiver = receivers[index];
    let t = triangle_at(receiver.x);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let w = unpack2x16unorm(receiver.y);
    let along = mat2x3f(b.position - a.position, c.position - a.position);
    let normal = (1.0 - w.x - w.y) * a.normal + w.x * b.normal + w.y * c.normal;
    let texel = middle_texel(unpacked(receiver.z));
    var metric = vec3f(0.0);
    if (FACETS) {
        metric = triangle_metric(receiver.x, along);
    } else {
        metric = metric_at(texel);
    }
    let unit = normal * inverseSqrt(max(dot(normal, normal), 1e-30));
    receiver_points[index] = Receiver(a.position + along * w, packed(texel), unit, metric);
}
