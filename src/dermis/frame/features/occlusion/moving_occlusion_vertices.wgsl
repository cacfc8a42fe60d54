// Open share of the sky at each vertex, weighted by the cosine: which of the depth maps from all around see it.
//#include "shape/geometry.wgsl"
//#include "each.wgsl"

override RESTING: bool = false; // whether it is the head at rest

const BESIDE: f32 = 0.7; // by how many texels' rise of its surface a vertex is lifted along its normal
const TOWARDS: f32 = 0.15; // and by how many texels towards the sky

struct View {
    column: vec4f, // these three: from a point and 1 to its texel and its depth
    row: vec4f,
    depth: vec4f,
    towards: vec3f, // the sky, unit
    right: vec3f, // from a texel to the next one [mm]
    up: vec3f,
}

struct Sky {
    views: array<View, 64>,
    vertices: u32,
}

@group(0) @binding(30) var<uniform> sky: Sky;
@group(0) @binding(31) var maps: texture_2d_array<f32>; // depth, 1 near, 0 nothing
@group(0) @binding(32) var<storage, read_write> shares: array<vec2f>; // open at rest, and now

// Share of the four texels around a point that let light through to it.
fn free_at(k: u32, p: vec3f) -> f32 {
    let point = vec4f(p, 1.0);
    let place = vec2f(dot(sky.views[k].column, point), dot(sky.views[k].row, point));
    let depth = dot(sky.views[k].depth, point);
    let at = vec2i(floor(place));
    let nearest = vec4f(
        textureLoad(maps, at, k, 0).x,
        textureLoad(maps, at + vec2i(1, 0), k, 0).x,
        textureLoad(maps, at + vec2i(0, 1), k, 0).x,
        textureLoad(maps, at + vec2i(1, 1), k, 0).x,
    );
    let f = place - vec2f(at);
    let weight = vec4f((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    return dot(select(vec4f(0.0), weight, nearest <= vec4f(depth)), vec4f(1.0));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= sky.vertices) {
        return;
    }
    let corner = corner_at(index);
    let n = corner.normal;
    var sum = vec2f(0.0);
    for (var k = 0u; k < textureNumLayers(maps); k++) {
        let l = sky.views[k].towards;
        let cosine = dot(n, l);
        if (cosine > 0.0) {
            let right = sky.views[k].right;
            let up = sky.views[k].up;
            let rise = abs(dot(n, right)) + abs(dot(n, up)); // of its plane within a texel
            let lifted = corner.position + BESIDE * rise * n + TOWARDS * max(length(right), length(up)) * l;
            sum += cosine * vec2f(free_at(k, lifted), 1.0);
        }
    }
    let open = sum.x / max(sum.y, 1e-6);
    if (RESTING) {
        shares[index].x = open;
    } else {
        shares[index].y = open;
    }
}
