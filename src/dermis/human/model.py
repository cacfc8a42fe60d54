"""The parametric human in the package: heads of people with expressions, neck, jaw and eyes that move."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.human.skin_maps.look import SkinLook
from dermis.human.skin_maps.reflection import face_colours
from dermis.mesh.geometry import build_mesh
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material
from dermis.mesh.quads import halves
from dermis.mesh.rig import MorphTargets, Rig, Skeleton

Layout = Literal["own", "hm08"]
Points = NDArray[np.float64]

YOUNG, OLD = 25.0, 90.0
"""Ages of the published people [years]."""

DELTA_MM = 0.01
"""Of a unit of displacements, here as in the published files."""

THANKS = "MakeHuman community, CC0"
_PLAIN_SIDE = 4  # texels of a map of one colour
_EXPRESSIONS = "faceunits/"
_EYE, _TOOTH, _TONGUE = (0.85, 0.83, 0.8), (0.7, 0.66, 0.56), (0.45, 0.16, 0.14)
MATERIALS = {
    "body": Material("skin"),
    "helper-l-eye": Material("left eye", "opaque", _EYE),
    "helper-r-eye": Material("right eye", "opaque", _EYE),
    "helper-upper-teeth": Material("upper teeth", "opaque", _TOOTH),
    "helper-lower-teeth": Material("lower teeth", "opaque", _TOOTH),
    "helper-tongue": Material("tongue", "opaque", _TONGUE),
    "cap": Material("cut", "opaque", (0.02, 0.02, 0.02)),
}
"""Groups of quads, and what they are."""
_BEGINS: dict[str, tuple[str, str, float]] = {  # a joint, or how far on the way between two
    "spine": ("neck", "neck", 0.0),
    "clavicle.L": ("l-clavicle", "l-clavicle", 0.0),
    "clavicle.R": ("r-clavicle", "r-clavicle", 0.0),
    "neck01": ("neck", "head", 0.0),
    "neck02": ("neck", "head", 1 / 3),
    "neck03": ("neck", "head", 2 / 3),
    "head": ("head", "head", 0.0),
    "jaw": ("mouth", "mouth", 0.0),
    "eye.L": ("l-eye", "l-eye", 0.0),
    "eye.R": ("r-eye", "r-eye", 0.0),
}
_PARENTS = {"neck02": "neck01", "neck03": "neck02", "head": "neck03"}
_PARENTS |= dict.fromkeys(("jaw", "eye.L", "eye.R"), "head")
_PARENTS |= dict.fromkeys(("neck01", "clavicle.L", "clavicle.R"), "spine")


class Moves(NamedTuple):
    """What published targets move, one after the other: points, displacements [mm], and where each begins."""

    names: tuple[str, ...]
    first: NDArray[np.int64]
    point: NDArray[np.int64]
    delta_mm: NDArray[np.float32]


def human_head(weights: Mapping[str, float], maps: Maps | None, layout: Layout) -> Head:
    """The head of a person, see `Human.head`.

    weights : of published targets
    """
    places, data, count = places_mm(weights), _data(), _count()
    uv, corner = _layout(layout)
    points = data["quads"][: len(corner)].astype(np.int64)  # the published layout has no cut
    pairs, vertex = np.unique(np.stack([points, corner], axis=-1).reshape(-1, 2), axis=0, return_inverse=True)
    faces = vertex.reshape(-1, 4)
    groups = [list(MATERIALS).index(str(name)) for name in data["group_names"]]
    material = np.array(groups)[data["group"][: len(corner)]]
    mesh = build_mesh(
        places[pairs[:, 0]],
        uv[pairs[:, 1]],
        halves(faces),
        np.repeat(material, 2),
        tuple(MATERIALS.values()),
        point=pairs[:, 0].astype(np.int32),
        quads=np.arange(2 * len(faces)).reshape(-1, 2),
    )
    rig = Rig(places[:count].astype(np.float32), _expressions(count), _skeleton(places, count))
    return Head("human", mesh, maps or _plain(), THANKS, rig)


def places_mm(weights: Mapping[str, float]) -> Points:
    """(n, 3) the points of a person, then the joints, from the middle between the eyes [mm].

    weights : of published targets

    Raises DermisError for targets that nobody knows.
    """
    data, moves = _data(), _moves()
    places = data["positions_mm"].astype(np.float64)
    known = {name: index for index, name in enumerate(moves.names)}
    for name, weight in weights.items():
        if name not in known:
            close = [one for one in known if name.split("/")[-1] in one][:3]
            hint = f"Did you mean {' or '.join(close)}?" if close else "List: dermis head --list-targets"
            refuse(f"target {name!r}", "a published target", "there is none of this name", hint)
        part = slice(*moves.first[known[name] : known[name] + 2])
        places[moves.point[part]] += weight * moves.delta_mm[part]
    eyes = [list(map(str, data["joint_names"])).index(name) for name in ("l-eye", "r-eye")]
    return np.asarray(places - places[_count() :][eyes].mean(axis=0))


def control_mm(weights: Mapping[str, float]) -> NDArray[np.float32]:
    """(p, 3) where the control points of a person lie, see `Human.positions_mm` [mm]."""
    return places_mm(weights)[: _count()].astype(np.float32)


def human_targets() -> tuple[str, ...]:
    """Names of the published targets by which people differ, for `Human(targets=...)`."""
    return tuple(name for name in _moves().names if not name.startswith((_EXPRESSIONS, "expression/")))


@cache
def _plain() -> Maps:
    """Skin of one colour, of usual pigments."""
    look = SkinLook()
    table = face_colours(look.eumelanin, look.oxygen)
    colour = table.read(np.array([look.melanin]), np.array([look.blood]))
    return Maps(colour=np.tile(colour.astype(np.float32), (_PLAIN_SIDE, _PLAIN_SIDE, 1)))


@cache
def _data() -> Mapping[str, NDArray[Any]]:
    file = resources.files(__package__).joinpath("data", "human.npz")
    with resources.as_file(file) as path, np.load(path) as found:
        return {name: found[name] for name in found}


def _count() -> int:
    """Of the points of the mesh, which joints come after."""
    data = _data()
    return len(data["positions_mm"]) - len(data["joint_names"])


@cache
def _moves() -> Moves:
    data = _data()
    delta = DELTA_MM * data["target_delta"].astype(np.float32)
    first, point = (data[name].astype(np.int64) for name in ("target_first", "target_point"))
    return Moves(tuple(map(str, data["target_names"])), first, point, delta)


def _layout(layout: Layout) -> tuple[Points, NDArray[np.int64]]:
    """uv (v, 2), v down, and its corners (q, 4) of the quads that it has."""
    data = _data()
    if layout == "own":
        return data["uv"].astype(np.float64), data["quads_uv"].astype(np.int64)
    return data["uv1"] * [1.0, -1.0] + [0.0, 1.0], data["quads_uv1"].astype(np.int64)


@cache
def _expressions(count: int) -> MorphTargets:
    """The ARKit blend shapes of the first points."""
    moves, chosen = _moves(), list[tuple[str, slice]]()
    for index, name in enumerate(moves.names):
        if name.startswith(_EXPRESSIONS):
            chosen.append((name.removeprefix(_EXPRESSIONS), slice(*moves.first[index : index + 2])))
    kept = [moves.point[part] < count for _, part in chosen]
    points = [moves.point[part][those] for (_, part), those in zip(chosen, kept, strict=True)]
    deltas = [moves.delta_mm[part][those] for (_, part), those in zip(chosen, kept, strict=True)]
    first = np.cumsum([0, *map(len, points)])
    names = tuple(name for name, _ in chosen)
    point = np.concatenate(points).astype(np.int32)
    return MorphTargets(names, first.astype(np.int32), point, np.concatenate(deltas))


def _skeleton(places: Points, count: int) -> Skeleton:
    """Spine, clavicles, a neck of three bones, head, jaw and eyes, where the person's joints are."""
    data = _data()
    names = tuple(map(str, data["bone_names"]))
    joints = dict(zip(map(str, data["joint_names"]), places[count:], strict=True))
    begin = np.array([(1 - t) * joints[a] + t * joints[b] for a, b, t in (_BEGINS[name] for name in names)])
    parent = np.array([names.index(_PARENTS[n]) if n in _PARENTS else -1 for n in names], np.int32)
    local, bind = (np.tile(np.eye(4), (len(names), 1, 1)) for _ in range(2))
    local[:, :3, 3] = begin - np.where(parent[:, None] >= 0, begin[parent], 0.0)
    bind[:, :3, 3] = -begin
    shares = data["weight"].astype(np.float32)
    bone, weight = data["bone"].astype(np.int32), shares / shares.sum(axis=1, keepdims=True)
    return Skeleton(names, parent, local, bind, np.eye(4), bone, weight)
