"""Export of scenes to the TOML files that `load_scene` reads."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.base.reading import is_file
from dermis.mesh.pose import Pose
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.head_table import has_region_table
from dermis.scene.living import SkinState
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.toml_text import table_text

_FILE_HEADER = "# A scene of dermis: lengths in mm from the head's centre, colours linear Rec. 709."
_FIELDS_SET_BY_REGIONS = {"rho_s"}  # fields of skins that a table of face regions sets
# fields of skins and environments that are file names, unless they name presets
_PATH_FIELDS = {"profile", "profile_map", "other_profiles", "name"}


def save_scene(path: Path, scene: Scene, settings: Settings, head: Mapping[str, Any]) -> None:
    """Write a scene atomically to a TOML file, from which `dermis render` draws the same picture.

    head : [head] table of the scene, with absolute file names

    Raises DermisError when the file cannot be written.
    """
    with atomic_file(path) as temporary:
        temporary.write_text(scene_text(scene, settings, head), encoding="utf-8")


def scene_text(scene: Scene, settings: Settings, head: Mapping[str, Any]) -> str:
    """Return the TOML text that describes a scene.

    head : [head] table of the scene, with absolute file names

    Raises DermisError for a pose given as point positions and for a pulse, which scene files cannot contain.
    """
    excluded = _FIELDS_SET_BY_REGIONS if has_region_table(head) else set()
    parts = [] if scene.lights else ['lights = "none"\n']
    parts += [table_text("[head]", head), *_pose_tables(scene.pose), *_state_tables(scene.state)]
    parts.append(_model_table("[skin]", scene.skin, excluded | {"pigments", "layers"}))
    if scene.skin.pigments:
        parts.append(_model_table("[skin.pigments]", scene.skin.pigments))
    layers = [layer.model_dump(exclude_none=True) for layer in scene.skin.layers]
    parts += [table_text("[[skin.layers]]", layer) for layer in layers]
    parts += [_model_table("[[lights]]", light) for light in scene.lights]
    if scene.environment:
        parts.append(_model_table("[environment]", scene.environment))
    parts += [_model_table("[camera]", scene.camera), _model_table("[render]", settings)]
    return "\n".join([_FILE_HEADER, *parts])


def _pose_tables(pose: Pose | None) -> list[str]:
    """Return the TOML tables [pose.weights] and [pose.bones] of a pose, or [pose] if both are empty."""
    if pose is None:
        return []
    if pose.positions_mm is not None:
        advice = "Keep positions in a separate file, such as .npy"
        refuse("pose", "weights and bones, which fit into a scene file", "it has positions_mm", advice)
    weights = {name: float(weight) for name, weight in pose.weights.items()}
    bones = {name: np.asarray(rotation, np.float64).tolist() for name, rotation in pose.bones.items()}
    tables = {"[pose.weights]": weights, "[pose.bones]": bones}
    return [table_text(title, values) for title, values in tables.items() if values] or ["[pose]\n"]


def _state_tables(state: SkinState | None) -> list[str]:
    """Return the TOML table [state] of a state of the skin; no table for skin at rest."""
    if state is None:
        return []
    if state.blood is not None:
        refuse(
            "state", "weights, which fit into a scene file", "it has a pulse", "Use dermis animate --pulse"
        )
    return [table_text("[state]", state.weights)] if state.weights else ["[state]\n"]


def _model_table(title: str, model: FrozenModel, excluded_fields: set[str] | None = None) -> str:
    table = model.model_dump(exclude=excluded_fields, exclude_none=True)
    for key in _PATH_FIELDS & table.keys():
        table[key] = _with_absolute_path(table[key])
    return table_text(title, table)


def _with_absolute_path(file_names: Any) -> Any:
    """Return a file name, or a tuple of file names, as absolute paths; names of presets are kept."""
    if isinstance(file_names, tuple):
        return tuple(map(_with_absolute_path, file_names))
    return str(Path(file_names).resolve()) if is_file(file_names) else file_names
