"""A mesh file of any format as one part, in its own units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index
from dermis.base.errors import refuse
from dermis.base.reading import is_file, understood
from dermis.formats.gltf.triangles import read_gltf
from dermis.formats.mesh_checks import check_amount, check_arrays
from dermis.formats.obj import read_obj
from dermis.formats.parts import Model, Part
from dermis.formats.ply import read_ply

FARTHEST_UV = 1e4
"""Beyond this uv are damage, not tiles."""
S = TypeVar("S", np.int64, np.float64)
Origin = Literal["auto", "top", "bottom"]
Up = Literal["y", "z"]
READERS: dict[str, Callable[[Path], Model]] = {
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".obj": read_obj,
    ".ply": read_ply,
}


def joined(parts: list[Part], source: Path) -> Part:
    """All parts together as one; its normals are NaN where the file has none."""
    uv = [_part_uv(part, source) for part in parts]
    for part, given in zip(parts, uv, strict=True):
        check_arrays(part.positions, given, part.triangles, source)
    start = np.cumsum([0, *(len(part.positions) for part in parts)])
    faces = np.cumsum([0, *(len(part.triangles) for part in parts)])
    targets: dict[str, list[tuple[Index, Doubles]]] = {}
    for part, offset in zip(parts, start, strict=False):
        for name, (vertex, delta) in part.targets.items():
            targets.setdefault(name, []).append((vertex + offset, delta))
    return Part(
        parts[0].group,
        np.vstack([part.positions for part in parts]),
        np.vstack(uv),
        np.vstack([_part_normals(part) for part in parts]),
        np.vstack([part.triangles + offset for part, offset in zip(parts, start, strict=False)]),
        {name: (np.concatenate(i), np.concatenate(d)) for name, (i, d) in _columns(targets).items()},
        _side_by_side([part.bone for part in parts]),
        _side_by_side([part.weight for part in parts]),
        np.vstack([part.quads + begin for part, begin in zip(parts, faces, strict=False)]),
    )


def taken(part: Part, used: Index) -> Part:
    """Some of a part's vertices, and what moves them."""
    number = np.full(len(part.positions), -1)
    number[used] = np.arange(len(used))
    targets = {
        name: (number[vertex][number[vertex] >= 0], delta[number[vertex] >= 0])
        for name, (vertex, delta) in part.targets.items()
    }
    bone = None if part.bone is None else part.bone[used]
    weight = None if part.weight is None else part.weight[used]
    return replace(part, positions=part.positions[used], targets=targets, bone=bone, weight=weight)


def _columns(
    rows: dict[str, list[tuple[Index, Doubles]]],
) -> dict[str, tuple[list[Index], list[Doubles]]]:
    return {name: ([one for one, _ in pairs], [two for _, two in pairs]) for name, pairs in rows.items()}


def _part_normals(part: Part) -> Doubles:
    if part.normals is not None and len(part.normals) == len(part.positions):
        return part.normals
    return np.full(part.positions.shape, np.nan)


def _side_by_side(arrays: list[NDArray[S] | None]) -> NDArray[S] | None:
    """Arrays of any width one under the other, filled up with 0; None if they are None."""
    given = [array for array in arrays if array is not None]
    if len(given) < len(arrays):
        return None
    width = max(array.shape[1] for array in given)
    return np.vstack([np.pad(array, ((0, 0), (0, width - array.shape[1]))) for array in given])


def _part_uv(part: Part, source: Path) -> Doubles:
    name = part.group.names[0] if part.group.names else "the mesh"
    if part.uv is None or part.uv.shape != (len(part.positions), 2):
        remedy = "Unwrap it (in Blender: Edit Mode, U > Unwrap) and export with uv"
        refuse(source, "uv at every vertex", f"{name!r} has none", remedy)
    if not np.abs(part.uv).max() <= FARTHEST_UV:
        came = f"{name!r} has some that are NaN, infinite or beyond {FARTHEST_UV:g}"
        refuse(source, "finite uv", came, "The file is damaged: export it again")
    return part.uv


def read_model(source: Path) -> Model:
    """The file as it is; whatever its reader raises on a damaged file becomes a refusal."""
    reader = READERS.get(source.suffix.lower())
    if reader is None:
        came = f"the suffix is {source.suffix!r}"
        refuse(source, f"a mesh file ({', '.join(READERS)})", came, "Export it as one of these")
    if not is_file(source):
        refuse(source, "a mesh file", "there is no such file", "Check the path")
    # a damaged file makes trimesh fail anywhere, with any exception
    with understood(source, f"a sound {source.suffix} mesh", Exception):
        model = reader(source)
    full = [part for part in model.parts if len(part.triangles)]
    if not full:
        refuse(source, "a mesh of triangles", "it has none", "Export the head as a polygon mesh")
    skins = [part for part in model.parts if part.group.has("skin")]
    if skins and not any(len(part.triangles) for part in skins):
        came = f"skin group {skins[0].group.names[0]!r} has no triangles"
        refuse(source, "a group of triangles that is skin", came, "Assign its faces to it, or rename it")
    check_amount(full, source)
    return replace(model, parts=full)


def upright(vectors: Doubles, up: Up) -> Doubles:
    """`vectors` (v, 3) with Y up: z-up turns about X, so that -Y, Blender's front, becomes +Z."""
    return vectors if up == "y" else np.column_stack((vectors[:, 0], vectors[:, 2], -vectors[:, 1]))
