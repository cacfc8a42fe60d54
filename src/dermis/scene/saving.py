"""Scenes written as the TOML that `load_scene` reads."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dermis.errors import refuse
from dermis.outputs import replacing
from dermis.reading import is_file
from dermis.scene.head_table import names_regions
from dermis.scene.model import Scene
from dermis.scene.plain import Plain
from dermis.scene.pose import Pose
from dermis.scene.settings import Settings

_HEADER = "# A scene of dermis: lengths in mm from the head's centre, colours linear Rec. 709."
_SAID_BY_REGIONS = {"rho_s"}
_FILES = {"profile", "name"}  # of skins and environments, where they are no presets


def save_scene(path: Path, scene: Scene, settings: Settings, head: Mapping[str, Any]) -> None:
    """Write a scene, whole or not at all; `dermis render` makes the same picture of it.

    head : the [head] table: where the head came from, files by names that hold from anywhere

    Raises DermisError when that is not possible.
    """
    with replacing(path) as trial:
        trial.write_text(scene_toml(scene, settings, head), encoding="utf-8")


def scene_toml(scene: Scene, settings: Settings, head: Mapping[str, Any]) -> str:
    """The text of a scene's file.

    Raises DermisError for a pose by places of points.
    """
    said = _SAID_BY_REGIONS if names_regions(head) else set()
    parts = [] if scene.lights else ['lights = "none"\n']
    parts += [_table("[head]", head), *_pose(Pose.of(scene.pose))]
    parts.append(_plain("[skin]", scene.skin, said | {"pigments", "layers"}))
    if scene.skin.pigments:
        parts.append(_plain("[skin.pigments]", scene.skin.pigments))
    layers = [layer.model_dump(exclude_none=True) for layer in scene.skin.layers]
    parts += [_table("[[skin.layers]]", layer) for layer in layers]
    parts += [_plain("[[lights]]", light) for light in scene.lights]
    if scene.environment:
        parts.append(_plain("[environment]", scene.environment))
    parts += [_plain("[camera]", scene.camera), _plain("[render]", settings)]
    return "\n".join([_HEADER, *parts])


def _pose(pose: Pose | None) -> list[str]:
    """Tables of a pose's weights and bones."""
    if pose is None:
        return []
    if pose.positions_mm is not None:
        remedy = "Keep those in a file of their own, such as .npy"
        refuse("pose", "weights and bones, which a scene's file can hold", "it has positions_mm", remedy)
    weights = {_key(name): float(weight) for name, weight in pose.weights.items()}
    bones = {_key(name): np.asarray(given, np.float64).tolist() for name, given in pose.bones.items()}
    tables = {"[pose.weights]": weights, "[pose.bones]": bones}
    return [_table(title, values) for title, values in tables.items() if values] or ["[pose]\n"]


def _key(name: str) -> str:
    """A name as a key, quoted where it has other letters than keys may have."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else _value(name)


def _plain(title: str, values: Plain, left_out: set[str] | None = None) -> str:
    table = values.model_dump(exclude=left_out, exclude_none=True)
    for key in _FILES & table.keys():
        if is_file(table[key]):
            table[key] = str(Path(table[key]).resolve())
    return _table(title, table)


def _table(title: str, values: Mapping[str, Any]) -> str:
    return "\n".join([title, *(f"{key} = {_value(value)}" for key, value in values.items()), ""])


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key} = {_value(one)}' for key, one in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")  # which JSON leaves as it is
