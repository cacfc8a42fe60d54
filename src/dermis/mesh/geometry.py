"""Welding and normals of triangles, and the assembly of a `Mesh` from plain arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.mesh.columns import crosses, dots
from dermis.mesh.mesh import Floats, Ints, Material, Mesh


def weld(rows: ArrayLike) -> Ints:
    """Index of the unique row for each row; rows are equal when all their float32 numbers are.

    rows : (v, k) positions [mm], or positions and uv side by side
    """
    table = np.asarray(rows, dtype=np.float32)
    order = np.lexsort(table.T)
    ordered = table[order]
    starts = np.ones(len(table), dtype=np.int32)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    index = np.empty(len(table), dtype=np.int32)
    index[order] = np.cumsum(starts) - 1
    return index


def compacted(triangles: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Vertices that triangles (f, 3) use (n,), in order, and the triangles by numbers of these."""
    seen = np.zeros(int(triangles.max()) + 1, bool)
    seen[triangles] = True
    return np.flatnonzero(seen).astype(np.int64), (np.cumsum(seen) - 1)[triangles]


def edges(triangles: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Unique edges (e, 2), the edge of each side (3f,) and the number of sides on each edge (e,).

    triangles : (f, 3) point indices; sides come as all 0-1, then all 1-2, then all 2-0
    """
    return unite_sides(np.vstack((triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]])))


def unite_sides(sides: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Unique edges (e, 2), the edge of each side (n,) and the number of sides on each edge (e,).

    sides : (n, 2) point indices, in either order
    """
    sides = np.sort(sides.astype(np.int64), axis=1)
    stride = int(sides.max()) + 1 if len(sides) else 1
    keys, of_side, counts = np.unique(
        sides[:, 0] * stride + sides[:, 1], return_inverse=True, return_counts=True
    )
    return np.column_stack((keys // stride, keys % stride)), of_side.reshape(-1), counts


def vertex_normals(positions: Floats, point: Ints, triangles: Ints) -> Floats:
    """Unit normals (v, 3): face normals weighted by the angle of the corner, summed over welded points.

    A uv seam leaves no crease. A point whose faces cancel or have no area gets +Z.

    positions : (v, 3) [mm]
    point : (v,) welded point of each corner vertex
    triangles : (f, 3)

    Angles, unlike areas, do not depend on how the surface is cut into triangles.
    """
    columns, corner = np.ascontiguousarray(positions.T, np.float64), np.ascontiguousarray(triangles.T)
    a, b, c = (columns.take(one, axis=1) for one in corner)  # (3, f) each
    ab, bc, ca = b - a, c - b, a - c
    across = crosses(ab, ca)
    sine = np.sqrt(dots(across, across))  # of each angle, times the lengths of its sides
    beside = [np.arctan2(sine, -dots(one, other)) for one, other in ((ca, ab), (ab, bc))]
    angle = np.stack([*beside, np.pi - beside[0] - beside[1]])
    angle /= np.where(sine > 0, -sine, 1.0)
    at, count = point.astype(np.intp).take(corner.ravel()), int(point.max()) + 1
    summed = np.stack([np.bincount(at, (one * angle).ravel(), count) for one in across], dtype=np.float64)
    length = np.sqrt(dots(summed, summed))
    flat = ~(length > 0)
    length[flat], summed[:, flat] = 1.0, [[0.0], [0.0], [1.0]]
    return np.ascontiguousarray((summed / length).astype(np.float32).take(point, axis=1).T)


def _trusted(given: Floats, computed: Floats) -> Floats:
    """The given normals where they are finite and nearly unit, else the computed ones."""
    length = np.linalg.norm(np.where(np.isfinite(given), given, 0).astype(np.float64), axis=1, keepdims=True)
    good = np.isfinite(given).all(axis=1, keepdims=True) & (np.abs(length - 1) < 0.05)
    return np.asarray(np.where(good, given / np.where(good, length, 1), computed).astype(np.float32))


def build_mesh(
    positions: ArrayLike,
    uv: ArrayLike,
    triangles: ArrayLike,
    material: ArrayLike,
    materials: tuple[Material, ...],
    normals: ArrayLike | None = None,
    point: ArrayLike | None = None,
    quads: ArrayLike = (),
) -> Mesh:
    """A `Mesh` with its points welded and its normals computed.

    positions : (v, 3) finite [mm]
    uv : (v, 2) v down
    triangles : (f, 3) corner vertices, at least one
    material : (f,) index into `materials`
    normals : (v, 3) kept where finite and of unit length; computed where not, or when None
    point : (v,) welded points if known; positions that are equal are welded when None
    quads : (q, 2) triangles that are the halves of a quad, as `Mesh` has them
    """
    place = np.ascontiguousarray(positions, dtype=np.float32)
    corner = np.ascontiguousarray(triangles, dtype=np.int32)
    flat = np.ascontiguousarray(uv, dtype=np.float32)
    points = weld(place) if point is None else np.asarray(point, dtype=np.int32)
    normal = vertex_normals(place, points, corner)
    if normals is not None:
        normal = _trusted(np.asarray(normals, dtype=np.float32), normal)
    groups = np.ascontiguousarray(material, dtype=np.int32)
    pairs = np.asarray(quads, dtype=np.int32).reshape(-1, 2)
    return Mesh(place, normal, flat, points, corner, groups, tuple(materials), pairs)
