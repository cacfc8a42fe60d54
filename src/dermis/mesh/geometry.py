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
    """Return the index of the unique row for each row; rows are equal if all their float32 numbers are.

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
    """Return the vertices (n,) that triangles (f, 3) use, and the triangles as indices into them."""
    used = np.zeros(int(triangles.max()) + 1, bool)
    used[triangles] = True
    return np.flatnonzero(used).astype(np.int64), (np.cumsum(used) - 1)[triangles]


def edges(triangles: NDArray[np.integer]) -> tuple[Index, Index, Index]:
    """Return the unique edges (e, 2), the edge of each side (3f,) and the number of sides on each edge (e,).

    triangles : (f, 3) point indices; sides are ordered as all 0-1, then all 1-2, then all 2-0
    """
    return unique_sides(np.vstack((triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]])))


def unique_sides(sides: NDArray[np.integer]) -> tuple[Index, Index, Index]:
    """Return the unique edges (e, 2), the edge of each side (n,) and the number of sides on each edge (e,).

    sides : (n, 2) point indices, in either order
    """
    sides = np.sort(sides.astype(np.int64), axis=1)
    stride = int(sides.max()) + 1 if len(sides) else 1
    keys, edge_of_side, counts = np.unique(
        sides[:, 0] * stride + sides[:, 1], return_inverse=True, return_counts=True
    )
    return np.column_stack((keys // stride, keys % stride)), edge_of_side.reshape(-1), counts


def vertex_normals(positions: Floats, point: Ints, triangles: Ints) -> Floats:
    """Return unit normals (v, 3): face normals weighted by the angle at the corner, summed over points.

    There is no crease at a uv seam. The normal is +Z at points whose faces cancel or have no area. Weights by
    angle, unlike those by area, do not depend on how the surface is triangulated.

    positions : (v, 3) [mm]
    point : (v,) unique point of each vertex
    triangles : (f, 3)
    """
    columns, corner = np.ascontiguousarray(positions.T, np.float64), np.ascontiguousarray(triangles.T)
    a, b, c = (columns.take(one, axis=1) for one in corner)  # (3, f) each
    ab, bc, ca = b - a, c - b, a - c
    normal = cross_columns(ab, ca)
    sine = np.sqrt(dot_columns(normal, normal))  # of each angle, times the lengths of its sides
    angles = [np.arctan2(sine, -dot_columns(one, other)) for one, other in ((ca, ab), (ab, bc))]
    angle = np.stack([*angles, np.pi - angles[0] - angles[1]])
    angle /= np.where(sine > 0, -sine, 1.0)
    index, count = point.astype(np.intp).take(corner.ravel()), int(point.max()) + 1
    total = np.stack([np.bincount(index, (one * angle).ravel(), count) for one in normal], dtype=np.float64)
    length = np.sqrt(dot_columns(total, total))
    undefined = ~(length > 0)
    length[undefined], total[:, undefined] = 1.0, [[0.0], [0.0], [1.0]]
    return np.ascontiguousarray((total / length).astype(np.float32).take(point, axis=1).T)


def sum_by_index(index: NDArray[np.integer], values: Doubles, count: int) -> Doubles:
    """Return the sums (count, k) of those rows of `values` (n, k) that have the same `index` (n,)."""
    columns = [np.bincount(index, weights=column, minlength=count) for column in values.T]
    return np.column_stack(columns)


def triangle_areas(corners: NDArray[np.floating]) -> Doubles:
    """Return the area of each triangle (f,) [mm2].

    corners : (f, 3, 3) [mm]
    """
    p = np.asarray(corners, dtype=np.float64)
    cross = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    return np.asarray(np.linalg.norm(cross, axis=1) / 2)


def cross_2d(a: Doubles, b: Doubles) -> Doubles:
    """Return the z component of the cross product of (..., 2) vectors."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def uv_cross(corners: NDArray[np.floating]) -> Doubles:
    """Return twice the signed uv area of each triangle (f,).

    corners : (f, 3, 2)
    """
    p = np.asarray(corners, dtype=np.float64)
    return cross_2d(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


def unit(vectors: Doubles, fallback: Doubles) -> Doubles:
    """Return vectors (n, 3) normalised to unit length, or `fallback` (n, 3) where they have no length."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    usable = length > 0
    return np.where(usable, vectors / np.where(usable, length, 1), fallback)


def tangents(positions: Floats, uv: Floats, normals: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """Return the derivatives of the position by u and by v, each (v, 3) [mm per unit of uv].

    They are area-weighted means over the triangles of each vertex that have uv area; a vertex without any
    gets two orthogonal directions of 1 mm, so that nothing divides by 0.

    positions, normals : (v, 3) [mm], unit vectors
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
    total = sum_by_index(corner, rows, len(positions))
    mean = total[:, :6] / np.where(total[:, 6:] > 0, total[:, 6:], 1)
    return _nonzero_tangents(mean[:, :3], mean[:, 3:], normals.astype(np.float64))


def _nonzero_tangents(dpdu: Doubles, dpdv: Doubles, normals: Doubles) -> tuple[Floats, Floats]:
    """Return both derivatives; where one has no length, two directions of 1 mm orthogonal to the normal."""
    # the axis that is least parallel to the normal
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = unit(np.cross(axis, normals), axis)
    short = np.minimum(np.linalg.norm(dpdu, axis=1), np.linalg.norm(dpdv, axis=1)) < 1e-6
    u = np.where(short[:, None], across, dpdu)
    v = np.where(short[:, None], np.cross(across, normals), dpdv)
    return u.astype(np.float32), v.astype(np.float32)


def split_quads(quads: NDArray[np.integer]) -> Index:
    """Return the triangles (a, b, c) and (c, d, a) of each quad (2q, 3), one pair after the other.

    quads : (q, 4)
    """
    return np.ascontiguousarray(quads[:, [0, 1, 2, 2, 3, 0]], np.int64).reshape(-1, 3)


def dot_columns(a: NDArray[T], b: NDArray[T]) -> NDArray[T]:
    """Return the dot products (..., n) of column vectors (..., 3, n)."""
    x, y, z = (a[..., c, :] * b[..., c, :] for c in range(3))
    return np.asarray(x + y + z)


def cross_columns(a: NDArray[T], b: NDArray[T]) -> NDArray[T]:
    """Return the cross products (..., 3, n) of column vectors (3, n) and (..., 3, n)."""
    result: NDArray[T] = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for c in range(3):  # in place, as stacking three new arrays takes ten times as long
        one, other, into = (c + 1) % 3, (c + 2) % 3, result[..., c, :]
        np.multiply(a[one], b[..., other, :], out=into)
        into -= a[other] * b[..., one, :]
    return result


def components(count: int, a: NDArray[np.integer], b: NDArray[np.integer]) -> Index:
    """Return the connected component of each node (n,), numbered from 0 in the order of first nodes.

    count : number of nodes
    a, b : (l,) pairs of connected nodes
    """
    label = np.arange(count)
    while True:
        before = label.copy()
        smaller = np.minimum(before[a], before[b])
        for nodes in (a, b, before[a], before[b]):  # the nodes and their labels, which are nodes too
            np.minimum.at(label, nodes, smaller)
        label = label[label]
        if np.array_equal(label, before):
            return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def expand_runs(first: Index, count: Index) -> tuple[Index, Index]:
    """Expand runs of consecutive integers: return the run that each integer belongs to, and the integers.

    first, count : first integer of each run and its length
    """
    which = np.repeat(np.arange(len(count)), count)
    start = np.repeat(np.cumsum(count) - count, count)
    return which, np.arange(len(which)) - start + first[which]


def fibonacci_sphere(count: int) -> Doubles:
    """Return (count, 3) unit vectors on a golden spiral about +Y, each for an equal part of the sphere.

    Source: [Keinert2015].
    """
    index = np.arange(count) + 0.5
    y = 1.0 - 2.0 * index / count
    phi = np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - y**2)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=-1)
