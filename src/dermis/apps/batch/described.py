"""What the files of a data set mean: outputs, classes of labels, landmarks."""

from __future__ import annotations

from typing import Any

from dermis.apps.batch.encodings import file_kind, stored_as
from dermis.apps.batch.spec import Spec
from dermis.base.tables import read_rows
from dermis.frame.outputs import OUTPUTS
from dermis.human.labels.classes import label_classes
from dermis.human.landmarks.points import table_points
from dermis.human.landmarks.sets import SETS

_LABELS = "label", "label_face_synthetics"


def outputs_of(spec: Spec) -> dict[str, dict[str, Any]]:
    """Of each output: kind of its files, how numbers are stored, unit, content, value of the background."""
    return {
        name: {
            "file": file_kind(name, spec.encoding),
            "stored": stored_as(name, spec.encoding),
            "step": _levels(name, spec)[0],
            "zero": _levels(name, spec)[1],
            "unit": OUTPUTS[name].unit,
            "description": OUTPUTS[name].description.partition(", see ")[0],  # pages are elsewhere
            "background": OUTPUTS[name].background,
        }
        for name in spec.outputs
    }


def classes(spec: Spec) -> dict[str, dict[int, str]]:
    """Names of the classes by level, of each output of the spec that holds labels."""
    found: dict[str, dict[int, str]] = {}
    for one in label_classes():
        for output, level in zip(_LABELS, (one.number, one.face_synthetics), strict=True):
            if output in spec.outputs:
                named = found.setdefault(output, {})
                named[level] = f"{named[level]}, {one.name}" if level in named else one.name
    return {output: dict(sorted(named.items())) for output, named in found.items()}


def landmark_names(name: str, spec: Spec) -> list[str]:
    """Of the points of a set, or of a table that the spec names, in their order."""
    if name in SETS:
        return [row["landmark"] for row in read_rows("dermis.human.landmarks", name)]
    return [landmark for landmark, _ in table_points(spec.landmark_tables[name])]


def _levels(name: str, spec: Spec) -> tuple[float, int]:
    """Step and zero of its levels: value = (level - zero) * step; (1, 0) for numbers as they are."""
    levels = OUTPUTS[name].levels
    return (1.0, 0) if levels is None or file_kind(name, spec.encoding) != "png" else levels
