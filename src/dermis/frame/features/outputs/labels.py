"""Label outputs: the class of the surface or of the hair in each pixel, such as skin, lips or brow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.frame.features.hair.resources import has_strands
from dermis.frame.features.outputs.output_images import OutputImages, draw_output_images, stage_program
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.request import FrameRequest
from dermis.gpu import Bindings, Buffer, Device, Memo, MutableBindings, Recorder, Texture
from dermis.human.labels.classes import class_number, label_classes
from dermis.human.labels.fields import MeshLabels, hair_classes, mesh_labels
from dermis.mesh.head import Head
from dermis.scene.outputs import OUTPUTS

LABEL_STAGE = "label"
"""Name of the stage that writes labels and the cover by hair."""


@dataclass(frozen=True, eq=False)
class LabelBuffers:
    """Buffers that label.wgsl and strand_labels.wgsl read and write.

    tables : dictionary from names in label.wgsl to tables of the label classes of the mesh
    field_count : number of distance fields. A field holds the signed distance of each vertex to the border of
        a class, for borders that cross triangles
    hair_classes : buffer of the class of each strand, None if the head has no hair
    hair_labels : buffer of the class and the cover of the hair in each pixel, written by the hair pass
    """

    tables: MutableBindings
    field_count: int
    hair_classes: Buffer | None
    hair_labels: Buffer

    def hair_bindings(self, centre_triangles: Texture) -> Bindings | None:
        """Return the resources that the hair pass needs to label pixels, None if there is no hair.

        centre_triangles : texture with the index of the triangle that covers each pixel centre
        """
        if self.hair_classes is None:
            return None
        return {
            "hair_classes": self.hair_classes,
            "hair_labels": self.hair_labels,
            "centres": centre_triangles,
        }


def make_label_buffers(memo: Memo, device: Device, request: FrameRequest) -> LabelBuffers | None:
    """Return the buffers of labels and hair cover, None if neither labels nor landmarks are requested."""
    cached = memo.get
    if not request.landmarks and all(OUTPUTS[name].stage != LABEL_STAGE for name in request.outputs):
        return None
    head, settings = request.head.without_maps, request.settings
    labels = cached(mesh_labels, head)
    tables = cached(_upload_label_tables, device, labels)
    if not has_strands(request.head, settings):
        unused = cached(_hair_label_buffer, device, 1, caller_name="no hair labels")
        return LabelBuffers(tables, len(labels.classes), None, unused)
    pixels = settings.size[0] * settings.size[1]
    hair_labels = cached(_hair_label_buffer, device, pixels, caller_name="hair labels")
    return LabelBuffers(tables, len(labels.classes), cached(_upload_hair_classes, device, head), hair_labels)


def shader_constants() -> dict[str, int]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in the label shaders."""
    names = "right_brow", "left_brow", "hair", "beard", "lashes"
    return {f"class_{name}": class_number(name) for name in names} | {"class_count": len(label_classes())}


def draw_labels(
    graph: Recorder, output_images: OutputImages, buffers: LabelBuffers, inputs: StageInputs
) -> None:
    """Declare the pass that writes the label class of each pixel."""
    constants = ("FIELDS", buffers.field_count), ("HAIRS", buffers.hair_classes is not None)
    shader = stage_program(graph.device, output_images, constants)
    bindings = inputs.bindings(shader) | buffers.tables | {"hair_labels": buffers.hair_labels}
    draw_output_images(graph, output_images, shader, bindings)


def _upload_label_tables(device: Device, labels: MeshLabels) -> MutableBindings:
    """Upload the label classes of a mesh, and the label of each class in the FaceSynthetics dataset."""
    face_synthetics = [one.face_synthetics for one in label_classes()]
    arrays = {
        "label_base": labels.base.astype(np.uint32),
        "label_fields": labels.fields if labels.fields.size else np.zeros(1, np.float32),
        "label_classes": np.concatenate([face_synthetics, labels.classes]).astype(np.uint32),
    }
    return {name: device.buffer(array, "STORAGE") for name, array in arrays.items()}


def _upload_hair_classes(device: Device, head: Head) -> Buffer:
    return device.buffer(hair_classes(head).astype(np.uint32), "STORAGE")


def _hair_label_buffer(device: Device, word_count: int) -> Buffer:
    return device.storage_buffer(4 * word_count, "hair labels")
