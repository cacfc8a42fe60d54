"""Reference implementation of the curvature passes in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import edges, sum_by_index, triangle_areas
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]


def curvature_twin(mesh: Mesh, steps: int) -> Floats:
    """Return the (v,) root mean square of both principal curvatures after smoothing steps [1/mm]."""
    corners = mesh.point[mesh.triangles]
    area = triangle_areas(mesh.positions[mesh.triangles])
    count = int(mesh.point.max()) + 1
    rows = np.concatenate([area[:, None] * bend(mesh).reshape(-1, 9), area[:, None]], axis=1)
    summed = sum_by_index(corners.ravel(), np.repeat(rows, 3, axis=0), count)
    values = np.linalg.norm(summed[:, :9] / np.maximum(summed[:, 9:], 1e-12), axis=1) / np.sqrt(2.0)
    pairs, _, _ = edges(corners)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    degree = 1.0 + np.bincount(both[:, 0], minlength=count)
    for _ in range(steps):
        around = np.bincount(both[:, 0], weights=values[both[:, 1]], minlength=count)
        values = (values + around) / degree
    return np.asarray(values[mesh.point])


def bend(mesh: Mesh) -> Floats:
    """Return the (f, 3, 3) derivative of the normal by position in each triangle, 0 without area [1/mm]."""
    p, n = (a[mesh.triangles].astype(np.float64) for a in (mesh.positions, mesh.normals))
    sides, turns = p[:, 1:] - p[:, :1], n[:, 1:] - n[:, :1]
    across = np.cross(sides[:, 0], sides[:, 1])
    square = (across**2).sum(axis=1)[:, None]
    dual = np.stack([np.cross(sides[:, 1], across), np.cross(across, sides[:, 0])], axis=1)
    dual /= np.where(square > 0, square, np.inf)[..., None]
    change = np.einsum("fki,fkj->fij", turns, dual)
    unit = across / np.sqrt(np.where(square > 0, square, np.inf))
    flat = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    change = flat @ change @ flat
    return np.asarray(0.5 * (change + change.transpose(0, 2, 1)))
