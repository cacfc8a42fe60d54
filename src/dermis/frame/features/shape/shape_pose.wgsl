// Control points moved by morph targets, then by bones; lids slide over the eyes.
//#include "each.wgsl"
//#include "eyeball.wgsl"

override HAS_BONES: bool = false; // whether points follow bones
override HAS_CONTACTS: bool = false; // whether some stay off eyeballs

struct Influence {
    bone: vec4u,
    weight: vec4f, // they add up to 1
}

// What a point stays off.
struct Contact {
    apex: u32, // points of an eyeball: the cornea's apex, and the one opposite; the same for no eyeball
    back: u32,
    clear: f32, // least distance from its surface [mm of a usual eye]
}

@group(0) @binding(0) var<storage, read> rest: array<f32>; // three of each point [mm]
@group(0) @binding(1) var<storage, read> weights: array<f32>; // of the targets
@group(0) @binding(2) var<storage, read> matrices: array<vec4f>; // three rows of each bone, from rest to pose
@group(0) @binding(3) var<storage, read> first: array<u32>; // where a point's displacements begin
@group(0) @binding(4) var<storage, read> displacements: array<vec4f>; // at weight 1 [mm], and the target's number
@group(0) @binding(5) var<storage, read> influences: array<Influence>;
@group(0) @binding(6) var<storage, read_write> posed: array<f32>;
@group(0) @binding(7) var<storage, read> contacts: array<Contact>;

fn moved_by(bone: u32, p: vec4f) -> vec3f {
    let row = 3u * bone;
    return vec3f(dot(matrices[row], p), dot(matrices[row + 1u], p), dot(matrices[row + 2u], p));
}

fn resting(index: u32) -> vec3f {
    return vec3f(rest[3u * index], rest[3u * index + 1u], rest[3u * index + 2u]);
}

fn carried(index: u32, p: vec3f) -> vec3f {
    if (!HAS_BONES) {
        return p;
    }
    let influence = influences[index];
    let at = vec4f(p, 1.0);
    var sum = vec3f(0.0);
    for (var k = 0u; k < 4u; k++) {
        if (influence.weight[k] > 0.0) {
            sum += influence.weight[k] * moved_by(influence.bone[k], at);
        }
    }
    return sum;
}

fn kept_off(contact: Contact, p: vec3f) -> vec3f {
    let apex = carried(contact.apex, resting(contact.apex));
    let back = carried(contact.back, resting(contact.back));
    let size = length(apex - back);
    let axis = (apex - back) / size;
    let scale = size / (APEX_AT + SCLERA_MM);
    let middle = back + SCLERA_MM * scale * axis;
    let off = (p - middle) / scale;
    let far = max(length(off), 1e-6);
    let least = eyeball_radius(dot(off, axis) / far) + contact.clear;
    return middle + scale * max(1.0, least / far) * off;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&first) - 1u) {
        return;
    }
    var p = resting(index);
    for (var k = first[index]; k < first[index + 1u]; k++) {
        let by = displacements[k];
        p += weights[bitcast<u32>(by.w)] * by.xyz;
    }
    p = carried(index, p);
    if (HAS_CONTACTS && contacts[index].apex != contacts[index].back) {
        p = kept_off(contacts[index], p);
    }
    posed[3u * index] = p.x;
    posed[3u * index + 1u] = p.y;
    posed[3u * index + 2u] = p.z;
}
