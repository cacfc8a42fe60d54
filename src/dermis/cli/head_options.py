"""Options that tell how a head's file is to be read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dermis.cli.options import check, options_of
from dermis.scene.head_table import HeadTable

HEAD = {"specular": "specular_map", "roughness": "roughness_map"}
"""Options by field of a [head], where they are not called like it."""
_SHAPE = "unit_mm", "v_origin", "up", "opaque", "eyes", "eye_groups"
_MAPS = "colour", "normal", "normal_y", "height", "height_mm", "specular", "roughness"

if TYPE_CHECKING:
    HeadOptions = dict[str, Any]
    ShapeOptions = dict[str, Any]
    FileOptions = dict[str, Any]
else:
    HeadOptions = options_of(HeadTable, without=("name",), names=HEAD)
    ShapeOptions = options_of(HeadTable, only=_SHAPE)
    FileOptions = options_of(HeadTable, only=(*_SHAPE, *_MAPS), names=HEAD)


def check_head(name: str, options: Mapping[str, Any]) -> None:
    """Refuse what no head can be read with."""
    check(HeadTable, {"name": name, **options}, HEAD)
