"""Untangles mirrored triangles by smoothing their surroundings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import edges, uv_cross

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]

_RINGS = 5  # around mirrored triangles, of points that may move


def untangle(places: Doubles, triangles: Index) -> Doubles:
    """The places (n, 2) with few or no mirrored triangles.

    Points around these move to the mean of their neighbours, which mirrors no triangle within a convex
    outline [Tutte1963]; more and more points, until none is mirrored. The border stays.

    places : (n, 2) x to the right, y up
    triangles : (f, 3)
    """
    ends, _, counts = edges(triangles)
    inner = np.ones(len(places), dtype=bool)
    inner[ends[counts != 2]] = False
    for rings in range(_RINGS):
        free = np.zeros(len(places), dtype=bool)
        free[triangles[uv_cross(places[triangles]) <= 0]] = True
        for _ in range(rings):
            free[triangles[free[triangles].any(axis=1)]] = True
        free &= inner
        if not free.any():
            break
        places = _even(places, ends, free)
    return places


def _even(places: Doubles, ends: Index, free: NDArray[np.bool_]) -> Doubles:
    """The places with the free ones at the mean of their neighbours."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import laplacian
    from scipy.sparse.linalg import spsolve

    n = len(places)
    both = np.vstack((ends, ends[:, ::-1]))
    links = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    matrix: Any = laplacian(links)
    pull: Any = csr_array(matrix)[free]  # it comes in a form that is slow to index
    moved = places.copy()
    moved[free] = spsolve(pull[:, free].tocsc(), -(pull[:, ~free] @ places[~free])).reshape(-1, 2)
    return moved
