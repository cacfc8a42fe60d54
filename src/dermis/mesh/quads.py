"""Quads as pairs of triangles: files and control meshes have them, the frame draws halves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh

Index = NDArray[np.int64]


def halves(quads: NDArray[np.integer]) -> Index:
    """(2q, 3) triangles (a, b, c) and (c, d, a) of each quad, side by side; quads : (q, 4)."""
    return np.ascontiguousarray(quads[:, [0, 1, 2, 2, 3, 0]], np.int64).reshape(-1, 3)


def ply_sides(metadata: Mapping[str, Any]) -> Index:
    """How many corners each face of a .ply file has, by what trimesh keeps of it; no numbers for others."""
    data = metadata.get("_ply_raw", {}).get("face", {}).get("data")
    known = data.dtype.names if isinstance(data, np.ndarray) else data
    for name in ("vertex_index", "vertex_indices"):
        if name in (known or ()):
            rows = data[name]["f1"] if isinstance(data, np.ndarray) else data[name]
            return np.fromiter(map(len, rows), np.int64) if rows.dtype == object else np.full(*rows.shape)
    return np.empty(0, np.int64)


def find_pairs(sides: NDArray[np.integer], triangles: Index) -> Index:
    """(q, 2) triangles that are the halves of each quad of a file; empty when they are in no known order.

    sides : (n,) how many corners each face of the file has
    triangles : (f, 3) its faces as the reader has cut them: one after the other, or triangles first, then the
        first halves of all quads, the second halves and the fans of all others
    """
    none, count = np.empty((0, 2), dtype=np.int64), int((sides == 4).sum())
    if count == 0 or int((sides - 2).sum()) != len(triangles):
        return none
    in_place = (np.cumsum(sides - 2) - 2)[sides == 4]
    sorted_by_sides = int((sides == 3).sum()) + np.arange(count)
    for first, step in ((in_place, 1), (sorted_by_sides, count)):
        pairs = np.column_stack((first, first + step))
        a, b = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
        if (a[:, [0, 2]] == b[:, [2, 0]]).all():
            return pairs
    return none


def polygons(mesh: Mesh) -> tuple[Index, Index, NDArray[np.int32]]:
    """Corner vertices of all faces (n,), the number of each one's corners (f,) and its material (f,).

    Triangles come first, then quads.
    """
    first, second = mesh.quads.T
    alone = np.delete(np.arange(len(mesh.triangles)), mesh.quads.ravel())
    quads = np.column_stack((mesh.triangles[first], mesh.triangles[second, 1]))
    corner = np.concatenate((mesh.triangles[alone].ravel(), quads.ravel())).astype(np.int64)
    sides = np.repeat(np.array([3, 4]), (len(alone), len(quads)))
    return corner, sides, np.concatenate((mesh.material[alone], mesh.material[first]))
