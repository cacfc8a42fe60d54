"""The parametric human of MakeHuman (base mesh hm08): people, the 52 ARKit expressions, neck and eyes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.mesh.geometry import build_mesh
from dermis.mesh.head import Head
from dermis.mesh.maps import load_maps
from dermis.mesh.mesh import Material
from dermis.mesh.quads import halves
from dermis.mesh.rig import INFLUENCES, MorphTargets, Rig, Skeleton

Arrays = Mapping[str, NDArray[Any]]
_MM = 100.0  # in a unit of positions
_DELTA_MM = 0.01  # in a unit of displacements
_EXPRESSIONS = "faceunits/"
_EYE, _TOOTH, _TONGUE = (0.85, 0.83, 0.8), (0.7, 0.66, 0.56), (0.45, 0.16, 0.14)
MATERIALS = {
    "body": Material("skin"),
    "helper-l-eye": Material("left eye", "opaque", _EYE),
    "helper-r-eye": Material("right eye", "opaque", _EYE),
    "helper-upper-teeth": Material("upper teeth", "opaque", _TOOTH),
    "helper-lower-teeth": Material("lower teeth", "opaque", _TOOTH),
    "helper-tongue": Material("tongue", "opaque", _TONGUE),
}
"""Groups that are taken, and what they are; lashes are strips that want a texture."""
_BONES = {  # parent, and where it begins: a joint, or how far on the way between two
    "spine": ("", ("neck", "neck", 0.0)),
    "neck01": ("spine", ("neck", "head", 0.0)),
    "neck02": ("neck01", ("neck", "head", 1 / 3)),
    "neck03": ("neck02", ("neck", "head", 2 / 3)),
    "head": ("neck03", ("head", "head", 0.0)),
    "eye.L": ("head", ("l-eye", "l-eye", 0.0)),
    "eye.R": ("head", ("r-eye", "r-eye", 0.0)),
}
_TRUNK = ("spine", "breast", "clavicle", "shoulder", "upperarm", "lowerarm")  # bones of the file that stay


def hm08(
    folder: str | Path, person: Mapping[str, float] | None = None, colour: str | Path | None = None
) -> Head:
    """The head of a person.

    folder : holds human.npz
    person : weights of published targets by name, macro targets and others; all ancestries alike, a young
        woman, when left out
    colour : colour map in the published uv

    Raises DermisError when the file is missing or knows no such target.
    """
    path = Path(folder) / "human.npz"
    if not path.is_file():
        refuse(path, "the parametric human", "there is no such file", "Check the folder")
    with np.load(path) as found:
        data = {name: found[name] for name in found}
    places = _MM * data["positions_dm"].astype(np.float64) + _person(data, person or young_woman(), path)
    groups = [str(name) for name in data["group_names"]]
    kept = np.isin(data["quad_group"], [groups.index(name) for name in MATERIALS])
    corner = np.stack([data["quads"][kept], data["quads_uv"][kept]], axis=-1).astype(np.int64)
    used = np.unique(corner[..., 0])
    pairs, vertex = np.unique(corner.reshape(-1, 2), axis=0, return_inverse=True)
    quads = vertex.reshape(-1, 4)
    number = np.full(len(places), -1, np.int32)
    number[used] = np.arange(len(used))
    material = np.array([list(MATERIALS).index(groups[g]) for g in data["quad_group"][kept]])
    mesh = build_mesh(
        places[pairs[:, 0]],
        data["uv"][pairs[:, 1]] * [1, -1] + [0, 1],
        halves(quads),
        np.repeat(material, 2),
        tuple(MATERIALS.values()),
        point=number[pairs[:, 0]],
        quads=np.arange(2 * len(quads)).reshape(-1, 2),
    )
    skeleton = _skeleton(data, places, used)
    rig = Rig(places[used].astype(np.float32), _expressions(data, number), skeleton)
    return Head("hm08", mesh, load_maps(colour=colour), "MakeHuman community, CC0", rig)


def young_woman() -> dict[str, float]:
    """A third of each ancestry."""
    return {f"macrodetails/{name}-female-young": 1 / 3 for name in ("african", "asian", "caucasian")}


def _displacements(data: Arrays, index: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Points that a target moves and by how much [mm]."""
    part = slice(*data["target_offset"][index : index + 2])
    deltas = _DELTA_MM * data["target_delta_um10"][part].astype(np.float64)
    return data["target_vertex"][part].astype(np.int64), deltas


def _person(data: Arrays, person: Mapping[str, float], path: Path) -> NDArray[np.float64]:
    """(p, 3) what the targets of a person add to the base [mm]."""
    names = [str(name) for name in data["target_names"]]
    added = np.zeros(data["positions_dm"].shape)
    for name, weight in person.items():
        if name not in names or not math.isfinite(weight):
            refuse(path, "finite weights of its targets", f"{name!r} = {weight} came", "Correct it")
        point, delta = _displacements(data, names.index(name))
        added[point] += weight * delta
    return added


def _expressions(data: Arrays, number: NDArray[np.int32]) -> MorphTargets:
    """The ARKit blend shapes of the points that are kept.

    number : of each published point among these, -1 for none
    """
    names, first, points, deltas = list[str](), [0], list[Any](), list[Any]()
    for index, name in enumerate(map(str, data["target_names"])):
        if name.startswith(_EXPRESSIONS):
            point, delta = _displacements(data, index)
            kept = number[point] >= 0
            names.append(name.removeprefix(_EXPRESSIONS))
            points.append(number[point[kept]])
            deltas.append(delta[kept])
            first.append(first[-1] + int(kept.sum()))
    moved = np.concatenate(deltas).astype(np.float32)
    return MorphTargets(tuple(names), np.array(first, np.int32), np.concatenate(points), moved)


def _skeleton(data: Arrays, places: NDArray[np.float64], used: NDArray[np.int64]) -> Skeleton:
    """A neck of three bones, the head and the eyes; bones of the face and the trunk are part of these."""
    joints = dict(
        zip(map(str, data["joint_names"]), places[data["joint_vertices"]].mean(axis=1), strict=True)
    )
    names = tuple(_BONES)
    local = np.tile(np.eye(4), (len(names), 1, 1))
    begin = np.array([(1 - t) * joints[a] + t * joints[b] for _, (a, b, t) in _BONES.values()])
    parent = np.array([names.index(one) if one else -1 for one, _ in _BONES.values()], np.int32)
    local[:, :3, 3] = begin - np.where(parent[:, None] >= 0, begin[parent], 0.0)
    bind = np.tile(np.eye(4), (len(names), 1, 1))
    bind[:, :3, 3] = -begin
    bone, weight = _influences(data, names)
    return Skeleton(names, parent, local, bind, np.eye(4), bone[used], weight[used])


def _influences(data: Arrays, names: tuple[str, ...]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """(p, 4) bones of `names` and their weights."""
    standing = np.array([names.index(_stands_for(str(name))) for name in data["bone_names"]])
    table = np.zeros((len(data["positions_dm"]), len(names)))
    np.add.at(table, (data["weight_vertex"].astype(int), standing[data["weight_bone"]]), data["weight"])
    order = np.argsort(-table, axis=1, kind="stable")[:, :INFLUENCES]
    weight = np.take_along_axis(table, order, axis=1)
    lost = weight.sum(axis=1) <= 0  # a point without bones stays with the trunk
    weight[lost, 0], order[lost] = 1.0, names.index("spine")
    weight /= weight.sum(axis=1, keepdims=True)
    return order.astype(np.int32), weight.astype(np.float32)


def _stands_for(name: str) -> str:
    if name in _BONES:
        return name
    return "spine" if name.startswith(_TRUNK) else "head"
