"""Table of label classes, such as skin, iris and hair: what the pixels of a label image can show."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from dermis.base.tables import read_rows


class LabelClass(NamedTuple):
    """Label class, such as "iris", of the surface that a pixel shows.

    number : number of the class, which is the pixel value in the output `label`
    name : name of the class
    face_synthetics : number of the class in the data set FaceSynthetics, which is the pixel value in the
        output `label_face_synthetics`
    description : short description of what belongs to the class
    """

    number: int
    name: str
    face_synthetics: int
    description: str


@cache
def label_classes() -> tuple[LabelClass, ...]:
    """Return all label classes in the order of their numbers."""
    rows = read_rows(__package__, "classes")
    return tuple(
        LabelClass(int(row["number"]), row["name"], int(row["face_synthetics"]), row["description"])
        for row in rows
    )


@cache
def class_number(class_name: str) -> int:
    """Return the number of the label class with the name `class_name`."""
    return next(one.number for one in label_classes() if one.name == class_name)
