"""A second uv layout for a mesh, whose seams are elsewhere."""

from __future__ import annotations

import numpy as np

from dermis.atlas.unwrap.charts import grow, tidy
from dermis.atlas.unwrap.unwrap import unwrap
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Mesh, build_mesh

_CHARTS = 16
_LEAST_MM2 = 1e-6


def with_other_seams(mesh: Mesh) -> Mesh:
    """The same triangles in the same order on a layout of about 16 charts grown from random places.

    Triangles without an area keep no place on it: their uv is 0.
    """
    positions = np.zeros((int(mesh.point.max()) + 1, 3))
    positions[mesh.point] = mesh.positions
    points = mesh.point[mesh.triangles].astype(np.int64)
    kept = np.flatnonzero(triangle_areas(positions[points]) > _LEAST_MM2)
    triangles = points[kept]
    layout = unwrap(positions, triangles, tidy(grow(positions, triangles, _CHARTS), triangles))
    corner = np.full((len(points), 3), len(layout.uv), dtype=np.int64)
    corner[kept] = layout.triangles
    normals = np.zeros((len(positions), 3))
    normals[mesh.point] = mesh.normals
    point = np.append(layout.point, 0)
    uv = np.vstack([layout.uv, np.zeros(2)])
    return build_mesh(positions[point], uv, corner, mesh.material, mesh.materials, normals[point], point)
