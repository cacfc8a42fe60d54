"""Classes of the label outputs."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from dermis.base.tables import read_rows


class LabelClass(NamedTuple):
    """Class of a pixel.

    number : value in the output `label`
    face_synthetics : value in the output `label_face_synthetics`
    """

    number: int
    name: str
    face_synthetics: int
    description: str


@cache
def label_classes() -> tuple[LabelClass, ...]:
    """Return all classes, ordered by their consecutive numbers."""
    rows = read_rows(__package__, "classes")
    return tuple(
        LabelClass(int(row["number"]), row["name"], int(row["face_synthetics"]), row["description"])
        for row in rows
    )


@cache
def class_number(name: str) -> int:
    """Return the number of a class."""
    return next(one.number for one in label_classes() if one.name == name)
