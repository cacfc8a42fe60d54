"""A head whose uv layout has extreme seams: the human's skin in hundreds of charts."""

from __future__ import annotations

import numpy as np

from dermis.atlas.unwrap.charts import grow_charts
from dermis.atlas.unwrap.unwrap import unwrap
from dermis.human.person import Human
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Mesh, build_mesh

LEAST_MM2 = 1e-6
"""Triangles under it have no place on a layout."""


def many_charts_mesh(charts: int, subdivide: int = 0) -> Mesh:
    """Return the skin of the human without eyes, teeth and tongue, each chart with its own rotation."""
    mesh = Human().head(subdivide=subdivide).mesh
    points = mesh.point[mesh.triangles[mesh.material == 0]].astype(np.int64)
    positions, normals = (np.zeros((int(mesh.point.max()) + 1, 3)) for _ in range(2))
    positions[mesh.point], normals[mesh.point] = mesh.positions, mesh.normals
    triangles = points[triangle_areas(positions[points]) > LEAST_MM2]
    chart = grow_charts(positions, triangles, charts)
    upright = np.random.default_rng(0).normal(size=(int(chart.max()) + 1, 3))
    layout = unwrap(positions, triangles, chart, up_direction=upright[chart])
    places, smooth = positions[layout.point], normals[layout.point]
    kind = np.zeros(len(triangles))
    return build_mesh(places, layout.uv, layout.triangles, kind, mesh.materials[:1], smooth, layout.point)
