"""Areas of the vertices of a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.surface_diffusion import intrinsic_delaunay, intrinsic_triangulation
from dermis.mesh.geometry import sum_by_index


def vertex_areas(positions: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the area (n,) of each vertex [mm2]; diffusion preserves the sum of values times areas."""
    surface = intrinsic_delaunay(intrinsic_triangulation(positions, triangles))
    thirds = np.repeat(surface.areas() / 3, 3)
    return sum_by_index(surface.corners.ravel(), thirds[:, None], len(positions))[:, 0]
