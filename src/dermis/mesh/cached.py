"""Meshes and what moves them, kept on disk by the content of their files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.disk import Arrays, stored
from dermis.mesh.mesh import Material, Mesh
from dermis.mesh.outline import Outline
from dermis.mesh.rig import MorphTargets, Rig, Skeleton

_FORM = 5  # raise when `load_rigged` gives other results for the same file
_MESH = [field.name for field in fields(Mesh) if field.name != "materials"]
_TARGETS = [field.name for field in fields(MorphTargets) if field.name != "names"]
_SKELETON = [field.name for field in fields(Skeleton) if field.name != "names"]
_NAMES = [
    *_MESH,
    "outline",
    "told",
    "control",
    *(f"target {name}" for name in _TARGETS),
    *(f"bone {name}" for name in _SKELETON),
]
_NONE = np.zeros(0, np.float32)


class Rigged(NamedTuple):
    """A mesh, and the rig that moves its points; None for none."""

    mesh: Mesh
    rig: Rig | None


def cached_rigged(data: bytes, options: str, load: Callable[[], Rigged]) -> Rigged:
    """What `load` makes of a file, kept on disk by its content.

    data : the file, with everything that the mesh is made of
    options : how it is read
    """
    digest = hashlib.sha256(f"{_FORM} {options}".encode())
    digest.update(data)
    return _unpacked(stored("meshes", digest.hexdigest()[:40], _NAMES, lambda: _packed(load())))


def _packed(rigged: Rigged) -> Arrays:
    """All of it as arrays, empty ones for what there is not."""
    mesh, rig = rigged
    told: dict[str, Any] = {"materials": [asdict(material) for material in mesh.materials]}
    arrays = {name: getattr(mesh, name) for name in _MESH} | {"outline": mesh.outline.places_mm}
    rest: Arrays = dict.fromkeys((name for name in _NAMES if name not in arrays), _NONE)
    if rig is not None:
        told |= {"targets": list(rig.targets.names), "bones": None}
        rest["control"] = rig.positions_mm
        rest |= _fields(rig.targets, "target", _TARGETS)
    if rig is not None and rig.skeleton is not None:
        told["bones"] = list(rig.skeleton.names)
        rest |= _fields(rig.skeleton, "bone", _SKELETON)
    return arrays | rest | {"told": np.frombuffer(json.dumps(told).encode(), np.uint8)}


def _fields(thing: Any, kind: str, names: list[str]) -> Arrays:
    found = {f"{kind} {name}": getattr(thing, name) for name in names}
    return {name: _NONE if array is None else array for name, array in found.items()}


def _unpacked(found: Arrays) -> Rigged:
    told = json.loads(found["told"].tobytes())
    kinds = [Material(**one | {"colour": tuple(one["colour"])}) for one in told["materials"]]
    mesh = Mesh(**{name: found[name] for name in _MESH}, materials=tuple(kinds))
    vars(mesh)["outline"] = Outline(found["outline"])  # finding it imports scipy, which is slower
    if "targets" not in told:
        return Rigged(mesh, None)
    values: dict[str, NDArray[Any] | None] = {name: found[f"target {name}"] for name in _TARGETS}
    values["rest"] = values["rest"] if len(found["target rest"]) else None
    targets = MorphTargets(tuple(told["targets"]), **values)  # type: ignore[arg-type]
    if told["bones"] is None:
        return Rigged(mesh, Rig(found["control"], targets))
    skeleton = Skeleton(tuple(told["bones"]), **{name: found[f"bone {name}"] for name in _SKELETON})
    return Rigged(mesh, Rig(found["control"], targets, skeleton))
