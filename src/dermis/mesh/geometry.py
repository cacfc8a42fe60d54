"""Welding, normals and tangents of triangles, and the assembly of a `Mesh` from plain arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.mesh.mesh import Floats, Ints, Material, Mesh

Doubles = NDArray[np.float64]

MIN_UV_CROSS = 1e-12
"""Twice the signed uv area below which u and v have no direction on a triangle (1/70 texel at 8192)."""


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


def sum_at(index: NDArray[np.integer], values: Doubles, count: int) -> Doubles:
    """Sum of the rows of `values` (n, k) that carry each `index` (n,), as (count, k)."""
    columns = [np.bincount(index, weights=column, minlength=count) for column in values.T]
    return np.column_stack(columns)


def triangle_areas(corners: NDArray[np.floating]) -> Doubles:
    """Area of each triangle [mm2]; corners : (f, 3, 3) [mm]."""
    places = np.asarray(corners, dtype=np.float64)
    cross = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
    return np.asarray(np.linalg.norm(cross, axis=1) / 2)


def uv_cross(corners: NDArray[np.floating]) -> Doubles:
    """Twice the signed uv area of each triangle; corners : (f, 3, 2)."""
    places = np.asarray(corners, dtype=np.float64)
    a, b = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _unit(vectors: Doubles, instead: Doubles) -> Doubles:
    """`vectors` normalised, or `instead` where they have no length; both (n, 3)."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    usable = length > 0
    return np.where(usable, vectors / np.where(usable, length, 1), instead)


def vertex_normals(positions: Floats, point: Ints, triangles: Ints) -> Floats:
    """Unit normals (v, 3): face normals weighted by the angle of the corner, summed over welded points.

    A uv seam leaves no crease. A point whose faces cancel or have no area gets +Z.

    positions : (v, 3) [mm]
    point : (v,) welded point of each corner vertex
    triangles : (f, 3)

    Angles, unlike areas, do not depend on how the surface is cut into triangles.
    """
    corners = positions[triangles].astype(np.float64)
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    cross = np.cross(ahead, behind)
    angle = np.arctan2(np.linalg.norm(cross, axis=2), (ahead * behind).sum(axis=2))
    face = _unit(cross[:, 0], np.zeros((len(cross), 3)))
    count = int(point.max()) + 1
    summed = sum_at(point[triangles].ravel(), (face[:, None] * angle[..., None]).reshape(-1, 3), count)
    return np.asarray(_unit(summed, np.broadcast_to([0.0, 0.0, 1.0], summed.shape))[point].astype(np.float32))


def tangents(positions: Floats, uv: Floats, normals: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """Change of position with u and with v, dpdu and dpdv, each (v, 3) [mm per unit of uv].

    Averaged over the triangles of each corner vertex by area, without those that have no uv area; a vertex
    with no others gets two orthogonal directions of 1 mm, so that nothing divides by 0.

    positions, normals : (v, 3) [mm], unit
    uv : (v, 2)
    triangles : (f, 3)
    """
    p, q = positions[triangles].astype(np.float64), uv[triangles].astype(np.float64)
    cross, weight = uv_cross(q), triangle_areas(p)
    valid = (np.abs(cross) > MIN_UV_CROSS) & (weight > 0)
    p, q, cross, weight = p[valid], q[valid], cross[valid, None], weight[valid, None]
    e1, e2, d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    dpdu = (e1 * d2[:, 1:] - e2 * d1[:, 1:]) / cross
    dpdv = (e2 * d1[:, :1] - e1 * d2[:, :1]) / cross
    corner = triangles[valid].ravel()
    rows = np.repeat(np.hstack((dpdu * weight, dpdv * weight, weight)), 3, axis=0)
    summed = sum_at(corner, rows, len(positions))
    mean = summed[:, :6] / np.where(summed[:, 6:] > 0, summed[:, 6:], 1)
    return _with_length(mean[:, :3], mean[:, 3:], normals.astype(np.float64))


def _with_length(dpdu: Doubles, dpdv: Doubles, normals: Doubles) -> tuple[Floats, Floats]:
    """The pair; where either has no length, two directions of 1 mm across the normal."""
    # the axis least along the normal cannot be parallel to it
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = _unit(np.cross(axis, normals), axis)
    short = np.minimum(np.linalg.norm(dpdu, axis=1), np.linalg.norm(dpdv, axis=1)) < 1e-6
    u = np.where(short[:, None], across, dpdu)
    v = np.where(short[:, None], np.cross(across, normals), dpdv)
    return u.astype(np.float32), v.astype(np.float32)


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
    """A `Mesh` with its points welded and its normals and tangents computed.

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
    dpdu, dpdv = tangents(place, flat, normal, corner)
    groups = np.ascontiguousarray(material, dtype=np.int32)
    pairs = np.asarray(quads, dtype=np.int32).reshape(-1, 2)
    return Mesh(place, normal, flat, dpdu, dpdv, points, corner, groups, tuple(materials), pairs)
