"""All parts of a file as one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.check import check_arrays
from dermis.mesh.formats import Array, Index, Part

FARTHEST_UV = 1e4
"""Beyond this uv are damage, not tiles."""


def joined(parts: list[Part], source: Path) -> Part:
    """All parts together as one; its normals are NaN where the file has none."""
    uv = [_part_uv(part, source) for part in parts]
    for part, given in zip(parts, uv, strict=True):
        check_arrays(part.positions, given, part.triangles, source)
    start = np.cumsum([0, *(len(part.positions) for part in parts)])
    faces = np.cumsum([0, *(len(part.triangles) for part in parts)])
    targets: dict[str, list[tuple[Index, Array]]] = {}
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
    rows: dict[str, list[tuple[Index, Array]]],
) -> dict[str, tuple[list[Index], list[Array]]]:
    return {name: ([one for one, _ in pairs], [two for _, two in pairs]) for name, pairs in rows.items()}


def _part_normals(part: Part) -> Array:
    if part.normals is not None and len(part.normals) == len(part.positions):
        return part.normals
    return np.full(part.positions.shape, np.nan)


def _side_by_side(arrays: list[NDArray[Any] | None]) -> NDArray[Any] | None:
    """Arrays of any width one under the other, filled up with 0; None if they are None."""
    given = [array for array in arrays if array is not None]
    if len(given) < len(arrays):
        return None
    width = max(array.shape[1] for array in given)
    return np.vstack([np.pad(array, ((0, 0), (0, width - array.shape[1]))) for array in given])


def _part_uv(part: Part, source: Path) -> Array:
    name = part.group.names[0] if part.group.names else "the mesh"
    if part.uv is None or part.uv.shape != (len(part.positions), 2):
        remedy = "Unwrap it (in Blender: Edit Mode, U > Unwrap) and export with uv"
        refuse(source, "uv at every vertex", f"{name!r} has none", remedy)
    if not np.abs(part.uv).max() <= FARTHEST_UV:
        came = f"{name!r} has some that are NaN, infinite or beyond {FARTHEST_UV:g}"
        refuse(source, "finite uv", came, "The file is damaged: export it again")
    return part.uv
