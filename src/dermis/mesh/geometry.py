"""Geometry of triangles as plain arrays: welding, edges, areas, normals and tangents."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.arrays import Doubles, Floats, Index, Ints

MIN_UV_CROSS = 1e-12
"""Twice the signed uv area below which u and v have no direction on a triangle (1/70 texel at 8192)."""
T = TypeVar("T", np.float32, np.float64)


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


def compact_vertices(triangles: NDArray[np.integer]) -> tuple[Index, Index]:
    """Vertices that triangles (f, 3) use (n,), in order, and the triangles by numbers of these."""
    seen = np.zeros(int(triangles.max()) + 1, bool)
    seen[triangles] = True
    return np.flatnonzero(seen).astype(np.int64), (np.cumsum(seen) - 1)[triangles]


def edges(triangles: NDArray[np.integer]) -> tuple[Index, Index, Index]:
    """Unique edges (e, 2), the edge of each side (3f,) and the number of sides on each edge (e,).

    triangles : (f, 3) point indices; sides come as all 0-1, then all 1-2, then all 2-0
    """
    return unique_sides(np.vstack((triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]])))


def unique_sides(sides: NDArray[np.integer]) -> tuple[Index, Index, Index]:
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
    across = cross_columns(ab, ca)
    sine = np.sqrt(dot_columns(across, across))  # of each angle, times the lengths of its sides
    beside = [np.arctan2(sine, -dot_columns(one, other)) for one, other in ((ca, ab), (ab, bc))]
    angle = np.stack([*beside, np.pi - beside[0] - beside[1]])
    angle /= np.where(sine > 0, -sine, 1.0)
    at, count = point.astype(np.intp).take(corner.ravel()), int(point.max()) + 1
    summed = np.stack([np.bincount(at, (one * angle).ravel(), count) for one in across], dtype=np.float64)
    length = np.sqrt(dot_columns(summed, summed))
    flat = ~(length > 0)
    length[flat], summed[:, flat] = 1.0, [[0.0], [0.0], [1.0]]
    return np.ascontiguousarray((summed / length).astype(np.float32).take(point, axis=1).T)


def sum_by_index(index: NDArray[np.integer], values: Doubles, count: int) -> Doubles:
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


def unit(vectors: Doubles, instead: Doubles) -> Doubles:
    """`vectors` normalised, or `instead` where they have no length; both (n, 3)."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    usable = length > 0
    return np.where(usable, vectors / np.where(usable, length, 1), instead)


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
    summed = sum_by_index(corner, rows, len(positions))
    mean = summed[:, :6] / np.where(summed[:, 6:] > 0, summed[:, 6:], 1)
    return _with_length(mean[:, :3], mean[:, 3:], normals.astype(np.float64))


def _with_length(dpdu: Doubles, dpdv: Doubles, normals: Doubles) -> tuple[Floats, Floats]:
    """The pair; where either has no length, two directions of 1 mm across the normal."""
    # the axis least along the normal cannot be parallel to it
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = unit(np.cross(axis, normals), axis)
    short = np.minimum(np.linalg.norm(dpdu, axis=1), np.linalg.norm(dpdv, axis=1)) < 1e-6
    u = np.where(short[:, None], across, dpdu)
    v = np.where(short[:, None], np.cross(across, normals), dpdv)
    return u.astype(np.float32), v.astype(np.float32)


def split_quads(quads: NDArray[np.integer]) -> Index:
    """(2q, 3) triangles (a, b, c) and (c, d, a) of each quad, side by side; quads : (q, 4)."""
    return np.ascontiguousarray(quads[:, [0, 1, 2, 2, 3, 0]], np.int64).reshape(-1, 3)


def dot_columns(a: NDArray[T], b: NDArray[T]) -> NDArray[T]:
    """(..., n) of vectors (..., 3, n)."""
    x, y, z = (a[..., c, :] * b[..., c, :] for c in range(3))
    return np.asarray(x + y + z)


def cross_columns(a: NDArray[T], b: NDArray[T]) -> NDArray[T]:
    """(..., 3, n) of vectors (3, n) and (..., 3, n)."""
    found: NDArray[T] = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for c in range(3):  # each into its place: to stack three new arrays takes ten times as long
        one, other, into = (c + 1) % 3, (c + 2) % 3, found[..., c, :]
        np.multiply(a[one], b[..., other, :], out=into)
        into -= a[other] * b[..., one, :]
    return found


def components(count: int, a: NDArray[np.integer], b: NDArray[np.integer]) -> Index:
    """Component of each of `count` nodes (n,), counted from 0 in the order of their first nodes.

    a, b : (l,) nodes that are linked
    """
    label = np.arange(count)
    while True:
        before = label.copy()
        least = np.minimum(before[a], before[b])
        for ends in (a, b, before[a], before[b]):  # nodes, and the nodes that they are labelled by
            np.minimum.at(label, ends, least)
        label = label[label]
        if np.array_equal(label, before):
            return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def fibonacci_sphere(count: int) -> Doubles:
    """(count, 3) unit vectors along a golden spiral about +Y, each for an equal share of the sphere.

    Source: [Keinert2015].
    """
    index = np.arange(count) + 0.5
    y = 1.0 - 2.0 * index / count
    phi = np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - y**2)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=-1)
