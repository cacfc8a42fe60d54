// Poses the strands: each strand follows the quad of the skin in which it is rooted.
//#include "each.wgsl"
//#include "strand_knots.wgsl"

struct Strand {
    corner: vec4u, // points of its quad, in order around it
    weight: vec4f, // of the points at the root
    absorption: vec4f, // [1/mm], and cover of the root by other hair
}

@group(0) @binding(0) var<storage, read> points: array<f32>; // x, y, z [mm]
@group(0) @binding(1) var<storage, read> strands: array<Strand>;
@group(0) @binding(2) var<storage, read> knots: array<vec4f>; // coordinates in the frame of the quad: along, across, normal; radius [mm]
@group(0) @binding(3) var<storage, read_write> posed: array<vec4f>; // see strand_knots.wgsl

fn point_at(index: u32) -> vec3f {
    return vec3f(points[3u * index], points[3u * index + 1u], points[3u * index + 2u]);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&knots)) {
        return;
    }
    let hair = hair_of_knot(index);
    let strand = strands[hair];
    let a = point_at(strand.corner.x);
    let b = point_at(strand.corner.y);
    let c = point_at(strand.corner.z);
    let d = point_at(strand.corner.w);
    let root = mat4x3f(a, b, c, d) * strand.weight;
    let along = normalize((b - a) + (c - d));
    let across = cross(c - a, d - b);
    let normal = normalize(across - dot(across, along) * along);
    let knot = knots[index];
    posed[row_of_knot(index, hair)] = vec4f(root + mat3x3f(along, cross(normal, along), normal) * knot.xyz, knot.w);
    if (index == first_knot(hair)) {
        let row = row_of_hair(hair);
        posed[row] = vec4f(normal, 0.0);
        posed[row + 1u] = vec4f(strand.absorption.xyz, floor(COVER_STEPS * strand.absorption.w));
    }
}
