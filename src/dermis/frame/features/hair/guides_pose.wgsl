// Poses the guides: each knot follows the quads of the skin to which it is bound.
//#include "each.wgsl"

//#fill const ANCHORS: u32 = {anchors_per_guide_knot}; // quads that a knot follows

struct Anchor {
    corner: vec4u, // points of a quad, in order around it
    local: vec4f, // coordinates in its frame: along, across, normal [mm]; weight
}

@group(0) @binding(0) var<storage, read> points: array<f32>; // x, y, z [mm]
@group(0) @binding(1) var<storage, read> anchors: array<Anchor>;
@group(0) @binding(2) var<storage, read> guide_rest: array<vec4f>; // position of each knot on the mean person, and its height above the skin [mm]
@group(0) @binding(3) var<storage, read_write> bound_guides: array<vec4f>; // of each knot: position and height; normal of the skin and ceiling
@group(0) @binding(4) var<storage, read> guide_ceilings: array<f32>; // largest height of strands at each knot, below headwear [mm]

fn point_at(index: u32) -> vec3f {
    return vec3f(points[3u * index], points[3u * index + 1u], points[3u * index + 2u]);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&guide_rest)) {
        return;
    }
    var position = vec3f(0.0);
    var outward = vec3f(0.0);
    for (var k = 0u; k < ANCHORS; k += 1u) {
        let anchor = anchors[ANCHORS * index + k];
        let a = point_at(anchor.corner.x);
        let b = point_at(anchor.corner.y);
        let c = point_at(anchor.corner.z);
        let d = point_at(anchor.corner.w);
        let along = normalize((b - a) + (c - d));
        let across = cross(c - a, d - b);
        let normal = normalize(across - dot(across, along) * along);
        let knot = 0.25 * (a + b + c + d) + mat3x3f(along, cross(normal, along), normal) * anchor.local.xyz;
        position += anchor.local.w * knot;
        outward += anchor.local.w * normal;
    }
    bound_guides[2u * index] = vec4f(position, guide_rest[index].w);
    bound_guides[2u * index + 1u] = vec4f(normalize(outward), guide_ceilings[index]);
}
