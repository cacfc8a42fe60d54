"""What the labels of a frame are made from: classes and fields of the head's mesh, classes of its hairs."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.frame.asked import Asked
from dermis.frame.passes.outputs.labels import LabelSpace
from dermis.frame.strands import has_strands
from dermis.gpu import Device, Memo
from dermis.human.labels.classes import label_classes
from dermis.human.labels.fields import Labelling, labelling
from dermis.human.labels.of_human import hair_classes
from dermis.mesh.head import Head

STAGE = "label"


def label_space(memo: Memo, device: Device, asked: Asked) -> LabelSpace | None:
    """What the labels that are asked take, None where none are."""
    names, keep = asked.outputs, memo.keep
    if not any(name.startswith(STAGE) for name in names):
        return None
    head, settings = asked.head.bare, asked.settings
    found = keep(labelling, head)
    tables = keep(_tables, device, found)
    if not has_strands(asked.head, settings):
        return LabelSpace(tables, len(found.classes), None, keep(_words, device, 1, of="no hair labels"))
    pixels = settings.size[0] * settings.size[1]
    space = keep(_words, device, pixels, of="hair labels")
    return LabelSpace(tables, len(found.classes), keep(_hairs, device, head), space)


def _tables(device: Device, found: Labelling) -> dict[str, Any]:
    """The labelling, and the classes of its fields with those of FaceSynthetics by our numbers."""
    others = [one.face_synthetics for one in label_classes()]
    arrays = {
        "label_base": found.base.astype(np.uint32),
        "label_fields": found.fields if found.fields.size else np.zeros(1, np.float32),
        "label_classes": np.concatenate([others, found.classes]).astype(np.uint32),
    }
    return {name: device.buffer(array, "STORAGE") for name, array in arrays.items()}


def _hairs(device: Device, head: Head) -> Any:
    return device.buffer(hair_classes(head).astype(np.uint32), "STORAGE")


def _words(device: Device, count: int) -> Any:
    return device.space(4 * count, "hair labels")
