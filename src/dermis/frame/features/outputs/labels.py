"""Labels of a frame: the class of the part of the mesh or of the hairs that each pixel shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.frame.features.hair.resources import has_strands
from dermis.frame.features.outputs.planes import Planes, fill, stage_program
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.request import FrameRequest
from dermis.gpu import Bindings, Buffer, Device, Memo, MutableBindings, Recorder, Texture
from dermis.human.labels.classes import class_number, label_classes
from dermis.human.labels.fields import MeshLabels, hair_classes, labelling
from dermis.mesh.head import Head

STAGE = "label"


@dataclass(frozen=True, eq=False)
class LabelBuffers:
    """Buffers as label.wgsl and strand_labels.wgsl read them.

    tables : by their names there
    fields : number of fields
    hair_classes : class of each hair, None without hair
    hair_labels : coverage by hairs of each pixel, and their class
    """

    tables: MutableBindings
    fields: int
    hair_classes: Buffer | None
    hair_labels: Buffer

    def hair_bindings(self, centres: Texture) -> Bindings | None:
        """Return what the pass that draws hairs binds to label them too; None without hair."""
        if self.hair_classes is None:
            return None
        return {"hair_classes": self.hair_classes, "hair_labels": self.hair_labels, "centres": centres}


def make_label_buffers(memo: Memo, device: Device, request: FrameRequest) -> LabelBuffers | None:
    """Return what the requested labels take, None for none."""
    cached = memo.get
    if not any(name.startswith(STAGE) for name in request.outputs):
        return None
    head, settings = request.head.bare, request.settings
    found = cached(labelling, head)
    tables = cached(_tables, device, found)
    if not has_strands(request.head, settings):
        return LabelBuffers(tables, len(found.classes), None, cached(_words, device, 1, owner="no hair labels"))
    pixels = settings.size[0] * settings.size[1]
    space = cached(_words, device, pixels, owner="hair labels")
    return LabelBuffers(tables, len(found.classes), cached(_hairs, device, head), space)


def label_numbers() -> dict[str, int]:
    """Return the numbers that the shaders of labels fill in."""
    names = "right_brow", "left_brow", "hair", "beard", "lashes"
    return {f"class_{name}": class_number(name) for name in names} | {"class_count": len(label_classes())}


def draw_labels(
    graph: Recorder, planes: Planes, space: LabelBuffers, seen: StageInputs, centres: Texture
) -> None:
    """Declare the pass that labels the pixels."""
    constants = ("FIELDS", space.fields), ("HAIRS", space.hair_classes is not None)
    shader = stage_program(graph.device, planes, constants)
    bound = seen.bound(shader, centres) | space.tables | {"hair_labels": space.hair_labels}
    fill(graph, planes, shader, bound)


def _tables(device: Device, found: MeshLabels) -> MutableBindings:
    """Return the labelling, and the classes of its fields with those of FaceSynthetics by our numbers."""
    others = [one.face_synthetics for one in label_classes()]
    arrays = {
        "label_base": found.base.astype(np.uint32),
        "label_fields": found.fields if found.fields.size else np.zeros(1, np.float32),
        "label_classes": np.concatenate([others, found.classes]).astype(np.uint32),
    }
    return {name: device.buffer(array, "STORAGE") for name, array in arrays.items()}


def _hairs(device: Device, head: Head) -> Buffer:
    return device.buffer(hair_classes(head).astype(np.uint32), "STORAGE")


def _words(device: Device, count: int) -> Buffer:
    return device.storage_buffer(4 * count, "hair labels")
