// What the centre of each pixel shows, as a class: a part of the mesh, or the hairs over it.
//#include "each_hit.wgsl"

override FIELDS: u32 = 0u; // distances that each vertex has
override HAIRS: bool = false; // whether hairs are drawn

//#fill const CLASSES: u32 = {class_count};
//#include <label_outputs>
//#each label_outputs: override {NAME}_FIRST: u32 = UNASKED;

@group(0) @binding(56) var<storage, read> label_base: array<u32>; // class of each triangle
@group(0) @binding(57) var<storage, read> label_fields: array<f32>; // vertex by vertex, above 0 inside
@group(0) @binding(58) var<storage, read> label_classes: array<u32>; // of FaceSynthetics by ours; then those of the fields
@group(0) @binding(59) var<storage, read> hair_labels: array<u32>; // see hair_label.wgsl

fn class_of(seen: Seen) -> u32 {
    let t = seen.corners;
    let w = seen.weights;
    for (var k = 0u; k < FIELDS; k += 1u) {
        let field = vec3f(label_fields[FIELDS * t.x + k], label_fields[FIELDS * t.y + k], label_fields[FIELDS * t.z + k]);
        if (dot(w, field) > 0.0) {
            return label_classes[CLASSES + k];
        }
    }
    return label_base[seen.triangle];
}

// Class of the mesh under hairs, or that of the hairs if there is one.
fn shown(seen: Seen, there: bool, hair: u32) -> u32 {
    if (hair > 0u) {
        return hair;
    }
    return select(0u, class_of(seen), there);
}

fn label_output(seen: Seen, there: bool, hairs: u32) -> u32 {
    return shown(seen, there, hairs & 0xffu);
}

fn label_face_synthetics_output(seen: Seen, there: bool, hairs: u32) -> u32 {
    return label_classes[shown(seen, there, hairs >> 8u)];
}

fn put_seen(seen: Seen, there: bool, cell: Cell) {
    var hairs = 0u;
    if (HAIRS) {
        hairs = hair_labels[cell.index];
    }
    //#each label_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, {name}_output(seen, there, hairs)); }}
}
