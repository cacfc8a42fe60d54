"""What `load_head` is given, checked before anything is read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from dermis.base.errors import refuse, shown_value
from dermis.scene.field_errors import ImpossibleError
from dermis.scene.head_table import AUTO, NO_REGIONS, HeadTable

_UNITS_MM = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "inch": 25.4, "in": 25.4, "ft": 304.8}


def named(head: object) -> str:
    """The name of what is to be loaded."""
    if not isinstance(head, str | os.PathLike):
        came = "None came" if head is None else f"a {type(head).__name__} came"
        remedy = "Use a head as it is; write human.head() for that of a Human"
        refuse("load_head", "the name of a head or a file", came, remedy)
    return str(head)


def check_given(files: Mapping[str, object], **lengths: object) -> None:
    """Refuse words for lengths [mm], and pictures that are no files."""
    for name, value in lengths.items():
        if isinstance(value, str):
            known = value in _UNITS_MM
            remedy = f"Write {name}={_UNITS_MM[value]:g}" if known else "Write 10 for cm, 1000 for m"
            refuse(name, "a length in mm, as a number", f"{value!r} came", remedy)
    for role, file in files.items():
        if file is not None and not isinstance(file, str | os.PathLike):
            remedy = f"Write dataclasses.replace(head, maps=replace(head.maps, {role}=...)) for one in memory"
            refuse(role, "the name of a picture file", f"a {type(file).__name__} came", remedy)


def check_options(**options: Any) -> None:
    """Refuse values that no [head] can have; words where several may stand come as tuples."""
    regions = options.get("regions", AUTO)
    if regions not in (AUTO, NO_REGIONS):
        remedy = "Use with_regions for a table"
        refuse("regions", f"{AUTO} or {NO_REGIONS}", f"{shown_value(regions)} came", remedy)
    try:
        HeadTable(name="", **options)
    except ImpossibleError as error:
        raise ImpossibleError("load_head", error.findings) from None


def check_relief(height_mm: float | None, height: object, culprit: str = "height_mm") -> None:
    """Refuse a length without the heights that it is for."""
    if height_mm is not None and height is None:
        came = f"{height_mm} came without a height map"
        refuse(culprit, "a height map with it", came, "Give the map too, or leave height_mm out")
