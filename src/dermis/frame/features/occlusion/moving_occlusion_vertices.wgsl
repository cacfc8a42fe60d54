// Sky visibility at each vertex: the cosine-weighted fraction of the depth maps, drawn from all directions, in which the
// vertex is visible.
//#include "shape/geometry.wgsl"
//#include "each.wgsl"

override RESTING: bool = false; // whether the head is at rest

const NORMAL_OFFSET: f32 = 0.7; // lift of a vertex along its normal, relative to the rise of its tangent plane within a texel
const SKY_OFFSET: f32 = 0.15; // lift towards the sky [texel]

struct View {
    column: vec4f, // from (x, y, z, 1) to column, row and depth
    row: vec4f,
    depth: vec4f,
    to_sky: vec3f, // unit vector
    right: vec3f, // from a texel to the next one on the right, and above [mm]
    up: vec3f,
}

struct Sky {
    views: array<View, 64>,
    vertices: u32,
}

@group(0) @binding(30) var<uniform> sky: Sky;
@group(0) @binding(31) var maps: texture_2d_array<f32>; // depth, 1 near, 0 nothing
@group(0) @binding(32) var<storage, read_write> visibility: array<vec2f>; // at rest, and now

// Fraction of the four texels around a point in which it is visible.
fn visible_fraction(k: u32, p: vec3f) -> f32 {
    let point = vec4f(p, 1.0);
    let position = vec2f(dot(sky.views[k].column, point), dot(sky.views[k].row, point));
    let depth = dot(sky.views[k].depth, point);
    let at = vec2i(floor(position));
    let depths = vec4f(
        textureLoad(maps, at, k, 0).x,
        textureLoad(maps, at + vec2i(1, 0), k, 0).x,
        textureLoad(maps, at + vec2i(0, 1), k, 0).x,
        textureLoad(maps, at + vec2i(1, 1), k, 0).x,
    );
    let f = position - vec2f(at);
    let weight = vec4f((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    return dot(select(vec4f(0.0), weight, depths <= vec4f(depth)), vec4f(1.0));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= sky.vertices) {
        return;
    }
    let corner = corner_at(index);
    let n = corner.normal;
    var sum = vec2f(0.0);
    for (var k = 0u; k < textureNumLayers(maps); k++) {
        let l = sky.views[k].to_sky;
        let cosine = dot(n, l);
        if (cosine > 0.0) {
            let right = sky.views[k].right;
            let up = sky.views[k].up;
            let rise = abs(dot(n, right)) + abs(dot(n, up)); // of the tangent plane within a texel
            let lifted = corner.position + NORMAL_OFFSET * rise * n + SKY_OFFSET * max(length(right), length(up)) * l;
            sum += cosine * vec2f(visible_fraction(k, lifted), 1.0);
        }
    }
    let open = sum.x / max(sum.y, 1e-6);
    if (RESTING) {
        visibility[index].x = open;
    } else {
        visibility[index].y = open;
    }
}
