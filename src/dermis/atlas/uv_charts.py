"""Charts: the connected pieces of the uv layout, and which of them texture space can hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Ints
from dermis.mesh.geometry import MIN_UV_CROSS, components, edges, uv_cross, weld
from dermis.mesh.mesh import Mesh


def charts(mesh: Mesh) -> Ints:
    """Chart of each triangle (f,), counted from 0: triangles that share an edge in space and in uv."""
    # by place and uv, not by corner vertex: a vertex split for its normal only does not cut a chart
    corner = weld(np.hstack((mesh.positions, mesh.uv)))
    _, of_side, _ = edges(corner[mesh.triangles])
    faces = np.tile(np.arange(len(mesh.triangles)), 3)
    order = np.argsort(of_side, kind="stable")
    shared = of_side[order][1:] == of_side[order][:-1]
    a, b = faces[order][:-1][shared], faces[order][1:][shared]
    return components(len(mesh.triangles), a, b).astype(np.int32)


def triangle_uv_area(mesh: Mesh) -> Doubles:
    """Unsigned uv area of each triangle (f,), 1 being the whole map."""
    return np.asarray(np.abs(uv_cross(mesh.uv[mesh.triangles])) / 2)


def chart_uv_area(mesh: Mesh, chart: Ints) -> Doubles:
    """Unsigned uv area of each chart (c,), 1 being the whole map.

    chart : (f,) from `charts`
    """
    return np.asarray(np.bincount(chart, weights=triangle_uv_area(mesh)), dtype=np.float64)


def usable(mesh: Mesh, atlas: int, min_texels: float = 4.0) -> NDArray[np.bool_]:
    """Whether each triangle (f,) can be processed in texture space.

    False for triangles without uv area and for all triangles of a chart that is collapsed.

    atlas : width and height of the square map [texels]
    min_texels : a chart whose whole uv area is below this is collapsed [texels]
    """
    chart = charts(mesh)
    roomy = chart_uv_area(mesh, chart) * atlas**2 >= min_texels
    return np.asarray(roomy[chart] & (2 * triangle_uv_area(mesh) > MIN_UV_CROSS))
