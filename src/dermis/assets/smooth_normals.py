"""Normals that turn no faster than a length allows, also in creases."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.mesh import Mesh

Floats = NDArray[np.float64]
_FASTEST = 0.5  # share of the neighbours in one step of averaging


def smooth_normals(mesh: Mesh, variance_mm2: float) -> Floats:
    """The vertices' normals under a Gaussian over the surface, about, (v, 3).

    Vertices that stand in one place for different normals keep their own share of them.

    variance_mm2 : of the Gaussian [mm2]
    """
    around, edge = _neighbours(mesh)
    mean = _unit(_sums(mesh.point, mesh.normals))
    steps = max(1, round(variance_mm2 / (_FASTEST * edge**2 / 2)))
    share = min(
        _FASTEST, variance_mm2 / steps / (edge**2 / 2)
    )  # all the neighbours' would add half of edge^2
    normals = mesh.normals.astype(np.float64)
    for _ in range(steps):
        beside = around @ mean
        mean = _unit((1 - share) * mean + share * beside)
        normals = _unit((1 - share) * normals + share * beside[mesh.point])
    return normals


def _neighbours(mesh: Mesh) -> tuple[Any, float]:
    """(p, p) sparse matrix that takes the mean over the points around each, and the median edge [mm]."""
    from scipy.sparse import coo_matrix, diags

    corner = mesh.point[mesh.triangles]
    a, b = (
        np.concatenate([corner[:, k] for k in order]) for order in ((0, 1, 2, 1, 2, 0), (1, 2, 0, 0, 1, 2))
    )
    count = int(mesh.point.max()) + 1
    joined = coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count)).tocsr()
    joined.data[:] = 1.0
    place = mesh.positions[mesh.triangles].astype(np.float64)
    edge = float(np.median(np.linalg.norm(place[:, 1] - place[:, 0], axis=1)))
    return diags(1.0 / np.maximum(joined.sum(axis=1).A1, 1.0)) @ joined, edge


def _sums(point: NDArray[np.int32], values: NDArray[np.floating]) -> Floats:
    return np.stack([np.bincount(point, values[:, k]) for k in range(3)], axis=-1)


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-30))
