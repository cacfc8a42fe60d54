// Control points, moved first by morph targets and then by bones; points of the eyelids are kept outside the eyeballs.
//#include "each.wgsl"
//#include "eyeball.wgsl"

override HAS_BONES: bool = false; // whether bones move points
override HAS_CONTACTS: bool = false; // whether some points are kept outside the eyeballs

struct Influence {
    bone: vec4u,
    weight: vec4f, // they sum to 1
}

// Eyeball that a point is kept outside of.
struct Contact {
    apex: u32, // points of the eyeball: apex of the cornea and the opposite point; equal without an eyeball
    back: u32,
    clear: f32, // least distance from its surface [mm of an average eye]
}

@group(0) @binding(0) var<storage, read> rest: array<f32>; // three floats per point [mm]
@group(0) @binding(1) var<storage, read> weights: array<f32>; // of the morph targets
@group(0) @binding(2) var<storage, read> matrices: array<vec4f>; // three rows of each bone, from rest to pose
@group(0) @binding(3) var<storage, read> first: array<u32>; // start of the displacements of each point
@group(0) @binding(4) var<storage, read> displacements: array<vec4f>; // at weight 1 [mm], and number of the morph target
@group(0) @binding(5) var<storage, read> influences: array<Influence>;
@group(0) @binding(6) var<storage, read_write> posed: array<f32>;
@group(0) @binding(7) var<storage, read> contacts: array<Contact>;

fn transform_by_bone(bone: u32, p: vec4f) -> vec3f {
    let row = 3u * bone;
    return vec3f(dot(matrices[row], p), dot(matrices[row + 1u], p), dot(matrices[row + 2u], p));
}

fn rest_position(index: u32) -> vec3f {
    return vec3f(rest[3u * index], rest[3u * index + 1u], rest[3u * index + 2u]);
}

fn skinned(index: u32, p: vec3f) -> vec3f {
    if (!HAS_BONES) {
        return p;
    }
    let influence = influences[index];
    let at = vec4f(p, 1.0);
    var sum = vec3f(0.0);
    for (var k = 0u; k < 4u; k++) {
        if (influence.weight[k] > 0.0) {
            sum += influence.weight[k] * transform_by_bone(influence.bone[k], at);
        }
    }
    return sum;
}

fn outside_eyeball(contact: Contact, p: vec3f) -> vec3f {
    let apex = skinned(contact.apex, rest_position(contact.apex));
    let back = skinned(contact.back, rest_position(contact.back));
    let size = length(apex - back);
    let axis = (apex - back) / size;
    let scale = size / (APEX_AT + SCLERA_MM);
    let centre = back + SCLERA_MM * scale * axis;
    let offset = (p - centre) / scale;
    let distance_mm = max(length(offset), 1e-6);
    let least = eyeball_radius(dot(offset, axis) / distance_mm) + contact.clear;
    return centre + scale * max(1.0, least / distance_mm) * offset;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&first) - 1u) {
        return;
    }
    var p = rest_position(index);
    for (var k = first[index]; k < first[index + 1u]; k++) {
        let displacement = displacements[k];
        p += weights[bitcast<u32>(displacement.w)] * displacement.xyz;
    }
    p = skinned(index, p);
    if (HAS_CONTACTS && contacts[index].apex != contacts[index].back) {
        p = outside_eyeball(contacts[index], p);
    }
    posed[3u * index] = p.x;
    posed[3u * index + 1u] = p.y;
    posed[3u * index + 2u] = p.z;
}
