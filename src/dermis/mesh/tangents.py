"""Areas of triangles in space and on the map, and how positions change with uv."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]
Ints = NDArray[np.int32]

MIN_UV_CROSS = 1e-12
"""Twice the signed uv area below which u and v have no direction on a triangle (1/70 texel at 8192)."""


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
    summed = sum_at(corner, rows, len(positions))
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
