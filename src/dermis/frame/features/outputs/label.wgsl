// Class at the centre of each pixel: a part of the mesh, or the hair over it.
//#include "each_hit.wgsl"

override FIELDS: u32 = 0u; // number of distance fields
override HAIRS: bool = false; // whether hair is drawn

//#fill const CLASSES: u32 = {class_count};
//#include <label_outputs>
//#each label_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

@group(0) @binding(56) var<storage, read> label_base: array<u32>; // class of each triangle
@group(0) @binding(57) var<storage, read> label_fields: array<f32>; // distances by vertex, positive inside
@group(0) @binding(58) var<storage, read> label_classes: array<u32>; // FaceSynthetics class of each class, then the classes of the fields
@group(0) @binding(59) var<storage, read> hair_labels: array<u32>; // see strand_labels.wgsl

fn class_of(hit: SurfaceHit) -> u32 {
    let t = hit.corners;
    let w = hit.weights;
    for (var k = 0u; k < FIELDS; k += 1u) {
        let field = vec3f(label_fields[FIELDS * t.x + k], label_fields[FIELDS * t.y + k], label_fields[FIELDS * t.z + k]);
        if (dot(w, field) > 0.0) {
            return label_classes[CLASSES + k];
        }
    }
    return label_base[hit.triangle];
}

// Class of the hair if there is one, else of the mesh.
fn label_at(hit: SurfaceHit, found_hit: bool, hair: u32) -> u32 {
    if (hair > 0u) {
        return hair;
    }
    return select(0u, class_of(hit), found_hit);
}

fn label_output(hit: SurfaceHit, found_hit: bool, hairs: u32) -> u32 {
    return label_at(hit, found_hit, hairs & 0xffu);
}

fn label_face_synthetics_output(hit: SurfaceHit, found_hit: bool, hairs: u32) -> u32 {
    return label_classes[label_at(hit, found_hit, (hairs >> 8u) & 0xffu)];
}

fn label_amodal_output(hit: SurfaceHit, found_hit: bool, hairs: u32) -> u32 {
    return label_at(hit, found_hit, 0u);
}

fn hair_alpha_output(hit: SurfaceHit, found_hit: bool, hairs: u32) -> f32 {
    return f32(hairs >> 24u) / 255.0;
}

fn write_outputs(hit: SurfaceHit, found_hit: bool, slot: PixelSlot) {
    var hairs = 0u;
    if (HAIRS) {
        hairs = hair_labels[slot.index];
    }
    //#each label_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, {name}_output(hit, found_hit, hairs)); }}
}
