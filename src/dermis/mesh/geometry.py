"""Geometry of triangle meshes in plain arrays: welding, edges, areas, normals and tangents."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.arrays import Doubles, Floats, Index, Ints

MIN_DOUBLE_UV_AREA = 1e-12
"""Value of twice the uv area of a triangle up to which u and v have no usable directions on the triangle.

It is the area of a square whose side is 1/120 texel in a map of 8192 x 8192 texels.
"""
T = TypeVar("T", np.float32, np.float64)


def weld(vertex_rows: ArrayLike) -> Ints:
    """Return an index (v,) for each vertex; vertices with equal attributes get the same index.

    vertex_rows : (v, k) attributes of each vertex, such as its position, or its position and uv; they are
        compared in float32
    """
    table = np.asarray(vertex_rows, dtype=np.float32)
    order = np.lexsort(table.T)
    ordered = table[order]
    starts = np.ones(len(table), dtype=np.int32)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    index = np.empty(len(table), dtype=np.int32)
    index[order] = np.cumsum(starts) - 1
    return index


def compact_vertices(triangles: NDArray[np.integer]) -> tuple[Index, Index]:
    """Return the indices (n,) of the vertices that triangles use, and the triangles (f, 3) renumbered.

    The renumbered triangles refer to vertices by their position in the first array.

    triangles : (f, 3) vertex indices
    """
    used = np.zeros(int(triangles.max()) + 1, bool)
    used[triangles] = True
    return np.flatnonzero(used).astype(np.int64), (np.cumsum(used) - 1)[triangles]


def merge_near_points(
    positions: Doubles, triangles: NDArray[np.integer], spacing: float
) -> tuple[Doubles, Index]:
    """Merge the vertices in each cube of a regular grid into one vertex at their mean position.

    Returns the new vertices and the triangles (f, 3) between them, some of which have coincident corners.

    positions : (v, 3) vertex positions
    triangles : (f, 3) vertex indices
    spacing : side length of the cubes
    """
    cell = np.floor(positions / spacing).astype(np.int64)
    cell -= cell.min(axis=0)
    x, y, _ = cell.max(axis=0) + 1
    cell_key = cell[:, 0] + x * (cell[:, 1] + y * cell[:, 2])
    _, merged, count = np.unique(cell_key, return_inverse=True, return_counts=True)
    sums = [np.bincount(merged.reshape(-1), column) for column in positions.T]
    return np.stack(sums, axis=1) / count[:, None], merged.reshape(-1)[triangles]


def edges(triangles: NDArray[np.integer]) -> tuple[Index, Index, Index]:
    """Return the edges (e, 2) of a triangle mesh, each once, with the triangle sides that lie on them.

    The second array (3f,) has the index of the edge on which each triangle side lies: first the sides from
    corner 0 to corner 1 of all triangles, then those from 1 to 2, then those from 2 to 0. The third array
    (e,) has the number of triangle sides on each edge.

    triangles : (f, 3) point indices
    """
    return unique_sides(np.vstack((triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]])))


def edge_keys(corners: NDArray[np.integer]) -> Index:
    """Return a key (f, 3) for each triangle side; sides on the same edge have the same key.

    corners : (f, 3) point indices; side k runs from corner k to the next corner
    """
    start = corners.astype(np.int64)
    end = start[:, [1, 2, 0]]
    return np.minimum(start, end) * (int(start.max(initial=0)) + 1) + np.maximum(start, end)


def triangle_keys(corners: NDArray[np.integer], point_count: int) -> Index:
    """Return a key (f,) for each triangle; triangles with the same three points have the same key.

    corners : (f, 3) point indices
    point_count : number of points, at most two million
    """
    a, b, c = corners.T.astype(np.int64)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return np.asarray((low * point_count + a + b + c - low - high) * point_count + high)


def unique_sides(sides: NDArray[np.integer]) -> tuple[Index, Index, Index]:
    """Return edges (e, 2), each once, with the triangle sides that lie on them.

    The second array (n,) has the index of the edge on which each side lies. The third array (e,) has the
    number of sides on each edge.

    sides : (n, 2) point indices at the two ends of each triangle side, in either order
    """
    sides = np.sort(sides.astype(np.int64), axis=1)
    stride = int(sides.max()) + 1 if len(sides) else 1
    keys, edge_of_side, counts = np.unique(
        sides[:, 0] * stride + sides[:, 1], return_inverse=True, return_counts=True
    )
    return np.column_stack((keys // stride, keys % stride)), edge_of_side.reshape(-1), counts


def vertex_normals(positions: Floats, point: Ints, triangles: Ints) -> Floats:
    """Return vertex normals (v, 3): normalised sums of face normals, weighted by the corner angles.

    Vertices at the same point have the same normal, so that there is no crease at a uv seam. The normal is +Z
    where the sum is 0.

    positions : (v, 3) [mm]
    point : (v,) index of the point at which each vertex lies; see `Mesh.point`
    triangles : (f, 3) vertex indices
    """
    columns, corner = np.ascontiguousarray(positions.T, np.float64), np.ascontiguousarray(triangles.T)
    a, b, c = (columns.take(one, axis=1) for one in corner)  # (3, f) each
    ab, bc, ca = b - a, c - b, a - c
    normal = cross_columns(ab, ca)
    sine = np.sqrt(dot_columns(normal, normal))  # sine of each angle, times the lengths of its sides
    angles = [np.arctan2(sine, -dot_columns(one, other)) for one, other in ((ca, ab), (ab, bc))]
    angle = np.stack([*angles, np.pi - angles[0] - angles[1]])
    angle /= np.where(sine > 0, -sine, 1.0)
    index, count = point.astype(np.intp).take(corner.ravel()), int(point.max()) + 1
    total = np.stack([np.bincount(index, (one * angle).ravel(), count) for one in normal], dtype=np.float64)
    length = np.sqrt(dot_columns(total, total))
    undefined = ~(length > 0)
    length[undefined], total[:, undefined] = 1.0, [[0.0], [0.0], [1.0]]
    return np.ascontiguousarray((total / length).astype(np.float32).take(point, axis=1).T)


def sum_by_index(row_index: NDArray[np.integer], row_values: Doubles, sum_count: int) -> Doubles:
    """Return the sums (sum_count, k) of all rows with the same index.

    row_index : (n,) index of the sum to which each row is added
    row_values : (n, k) rows to add
    sum_count : number of sums
    """
    columns = [np.bincount(row_index, weights=column, minlength=sum_count) for column in row_values.T]
    return np.column_stack(columns)


def triangle_areas(corners: NDArray[np.floating]) -> Doubles:
    """Return the area of each triangle (f,) [mm²].

    corners : (f, 3, 3) corner positions [mm]
    """
    a, b, c = np.ascontiguousarray(np.asarray(corners, np.float64).transpose(1, 2, 0))
    cross = cross_columns(b - a, c - a)
    return np.asarray(np.sqrt(dot_columns(cross, cross)) / 2)


def cross_2d(a: Doubles, b: Doubles) -> Doubles:
    """Return the z components of the cross products a × b of vectors (..., 2) in the xy plane."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def uv_cross(corners: NDArray[np.floating]) -> Doubles:
    """Return twice the signed area (f,) of each triangle in uv space.

    corners : (f, 3, 2) uv of the corners
    """
    p = np.asarray(corners, dtype=np.float64)
    return cross_2d(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


def normalise_vectors(vectors: Doubles, fallback: Doubles) -> Doubles:
    """Normalise vectors (n, 3); vectors of length 0 are replaced by `fallback` (n, 3)."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    usable = length > 0
    return np.where(usable, vectors / np.where(usable, length, 1), fallback)


def tangents(positions: Floats, uv: Floats, normals: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """Return the derivatives (v, 3) of the position with respect to u and to v at each vertex.

    The derivatives [mm per unit of uv] are area-weighted means over the triangles of a vertex; triangles
    without uv area are ignored. A vertex whose triangles all lack uv area gets two orthogonal unit vectors,
    to avoid divisions by 0.

    positions, normals : (v, 3) positions [mm] and unit normals
    uv : (v, 2)
    triangles : (f, 3) vertex indices
    """
    p, q = positions[triangles].astype(np.float64), uv[triangles].astype(np.float64)
    cross, weight = uv_cross(q), triangle_areas(p)
    valid = (np.abs(cross) > MIN_DOUBLE_UV_AREA) & (weight > 0)
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
    """Return tangents (v, 3) along u and along v, neither of which is zero.

    Where `dpdu` or `dpdv` is 0, both are replaced by orthogonal vectors of length 1 in the tangent plane.
    """
    # the axis that is least parallel to the normal
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = normalise_vectors(np.cross(axis, normals), axis)
    short = np.minimum(np.linalg.norm(dpdu, axis=1), np.linalg.norm(dpdv, axis=1)) < 1e-6
    u = np.where(short[:, None], across, dpdu)
    v = np.where(short[:, None], np.cross(across, normals), dpdv)
    return u.astype(np.float32), v.astype(np.float32)


def split_quads(quads: NDArray[np.integer]) -> Index:
    """Split quads (q, 4) with corners a, b, c, d into triangles (2q, 3): (a, b, c) and (c, d, a)."""
    return np.ascontiguousarray(quads[:, [0, 1, 2, 2, 3, 0]], np.int64).reshape(-1, 3)


def dot_columns(a: NDArray[T], b: NDArray[T]) -> NDArray[T]:
    """Return the dot products (..., n) of vectors stored as columns (..., 3, n)."""
    x, y, z = (a[..., c, :] * b[..., c, :] for c in range(3))
    return np.asarray(x + y + z)


def cross_columns(a: NDArray[T], b: NDArray[T]) -> NDArray[T]:
    """Return the cross products (..., 3, n) of vectors stored as columns: a (3, n) and b (..., 3, n)."""
    result: NDArray[T] = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for c in range(3):  # in place, as stacking three new arrays takes ten times as long
        one, other, into = (c + 1) % 3, (c + 2) % 3, result[..., c, :]
        np.multiply(a[one], b[..., other, :], out=into)
        into -= a[other] * b[..., one, :]
    return result


def label_components(
    node_count: int, link_start: NDArray[np.integer], link_end: NDArray[np.integer]
) -> Index:
    """Return the index (n,) of the connected component of each node of a graph.

    Components are numbered in the order in which they first appear.

    node_count : n, number of nodes
    link_start, link_end : (l,) nodes at the two ends of each link
    """
    label = np.arange(node_count)
    while True:
        before = label.copy()
        smaller = np.minimum(before[link_start], before[link_end])
        for nodes in (
            link_start,
            link_end,
            before[link_start],
            before[link_end],
        ):  # the nodes and their labels, which are nodes too
            np.minimum.at(label, nodes, smaller)
        label = label[label]
        if np.array_equal(label, before):
            return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def expand_runs(run_start: Index, run_length: Index) -> tuple[Index, Index]:
    """List all integers in r runs of consecutive integers.

    Returns two arrays of the same length: the index of the run of each integer, and the integer itself.

    run_start, run_length : (r,) first integer and length of each run
    """
    which = np.repeat(np.arange(len(run_length)), run_length)
    start = np.repeat(np.cumsum(run_length) - run_length, run_length)
    return which, np.arange(len(which)) - start + run_start[which]


def fibonacci_sphere(vector_count: int) -> Doubles:
    """Return unit vectors (vector_count, 3) spread evenly over the sphere, on a spiral about +Y.

    Source: [Keinert2015].
    """
    index = np.arange(vector_count) + 0.5
    y = 1.0 - 2.0 * index / vector_count
    phi = np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - y**2)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=-1)
