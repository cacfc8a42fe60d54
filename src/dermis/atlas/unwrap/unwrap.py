"""Unwrapping of a mesh into packed charts, which the caller specifies or which grow from random triangles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from dermis.atlas.unwrap.charts import grow_charts, smooth_charts
from dermis.atlas.unwrap.seams import ChartMesh, FlatCharts, border_edges, flatten_charts
from dermis.base.arrays import Doubles, Index
from dermis.base.errors import refuse
from dermis.mesh.geometry import cross_2d, expand_runs, triangle_areas
from dermis.mesh.mesh import Mesh, build_mesh

_GRID_CELLS_PER_SIDE = 512  # number of cells along each side of the map
_MAX_CHART_PLACEMENTS = 1000  # largest number of charts that are placed, in all orders together
_BISECTION_COUNT = 9  # number of trials in the search for the scale
_MIN_SCALE_GAIN = 1.004  # gain of scale for which the search is repeated with another order
CHART_PADDING = 1 / 128
"""Empty space between charts as a fraction of the map's side: 8 texels at 1024."""
DEFAULT_UP_DIRECTION = (0.0, 1.0, -0.1)
"""Direction in space that points up on the map: upwards and, for horizontal surfaces, backwards."""
_MIN_TRIANGLE_AREA_MM2 = 1e-10
_DEFAULT_CHART_COUNT = 16
_MIN_CHART_AREA_MM2 = 1e-6


def pack_charts(outlines: list[Doubles], padding: float) -> tuple[float, Doubles]:
    """Pack charts into the unit square; return a common scale, and the offset (c, 2) of each chart.

    Each chart is dropped onto the charts below, in the column where it comes to rest lowest [Levy2002].
    Several orders of the charts are tried, and the best result is returned.

    outlines : edges (k, 2, 2) of each chart's border, counter-clockwise
    padding : width of the empty space between charts as a fraction of the square's side; half as much is left
        at the square's edge

    Raises DermisError if there are more charts than fit side by side.
    """
    corner = np.array([edges.min(axis=(0, 1)) for edges in outlines])
    shifted = [edges - low for edges, low in zip(outlines, corner, strict=True)]
    size = np.array([edges.max(axis=(0, 1)) for edges in shifted])
    area = sum(float(cross_2d(edges[:, 0], edges[:, 1]).sum() / 2) for edges in shifted)
    bound = _GRID_CELLS_PER_SIDE / np.sqrt(max(area, (size**2).max()))
    best, cells = 0.0, None
    for order in _packing_orders(size):
        low, high = best, bound
        if cells is not None and _place_charts(shifted, order, best * _MIN_SCALE_GAIN, padding) is None:
            continue
        for _ in range(_BISECTION_COUNT):
            scale = (low + high) / 2
            found = _place_charts(shifted, order, scale, padding)
            if found is None:
                high = scale
            else:
                best, cells, low = scale, found, scale
    if cells is None:
        refuse("charts", "fewer charts", f"got {len(outlines)}", "Cut the mesh into larger charts")
    return best / _GRID_CELLS_PER_SIDE, (cells - best * corner) / _GRID_CELLS_PER_SIDE


def _packing_orders(chart_sizes: Doubles) -> Iterator[Index]:
    """Yield orders in which to place charts when they are packed: by height, by width, and random orders.

    chart_sizes : (c, 2) width and height of each chart
    """
    yield np.argsort(-chart_sizes[:, 1], kind="stable")
    yield np.argsort(-chart_sizes[:, 0], kind="stable")
    random = np.random.default_rng(0)
    for _ in range(min(_MAX_CHART_PLACEMENTS // len(chart_sizes), factorial(len(chart_sizes)) - 2)):
        yield random.permutation(len(chart_sizes))


def _place_charts(
    chart_edges: list[Doubles], chart_order: Index, scale: float, padding: float
) -> Doubles | None:
    """Drop charts onto each other on a square grid; return their lower left corners (c, 2) [cell].

    The result is None if the charts do not fit.

    chart_edges : border edges of each chart, with the lower left corner of the chart at 0
    chart_order : (c,) indices of the charts in the order in which they are dropped
    scale : cells per unit of the border edges
    padding : width of the empty space between charts, as a fraction of the grid's side
    """
    margin = int(np.ceil(padding * _GRID_CELLS_PER_SIDE / 2))
    horizon, cells = np.zeros(_GRID_CELLS_PER_SIDE, dtype=np.int64), np.zeros((len(chart_edges), 2))
    for k in chart_order:
        low, high = _column_extents(chart_edges[k] * scale, margin)
        if len(low) > _GRID_CELLS_PER_SIDE:
            return None
        heights = (np.lib.stride_tricks.sliding_window_view(horizon, len(low)) - low).max(axis=1)
        x = int(heights.argmin())
        y = int(heights[x])
        if y + high.max() >= _GRID_CELLS_PER_SIDE:
            return None
        horizon[x : x + len(low)] = np.maximum(horizon[x : x + len(low)], y + high + 1)
        cells[k] = x + margin, y + margin
    return cells


def _column_extents(edges: Doubles, margin_cells: int) -> tuple[Index, Index]:
    """Return the lowest and highest cell of a chart in each column (w,), with a margin of empty cells.

    edges : (k, 2, 2) edges of the chart's border [cell]
    margin_cells : width of the margin [cell]
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    steps = np.ceil(2 * np.abs(edges[:, 1] - edges[:, 0]).max(axis=1)).astype(np.int64) + 1
    which, step = expand_runs(np.zeros_like(steps), steps)
    t = step / steps[which]
    x, y = (edges[which, 0] * (1 - t)[:, None] + edges[which, 1] * t[:, None]).astype(np.int64).T
    width = int(x.max()) + 1 + 2 * margin_cells
    low, high = np.full(width, _GRID_CELLS_PER_SIDE), np.full(width, -_GRID_CELLS_PER_SIDE)
    np.minimum.at(low, x + margin_cells, y)
    np.maximum.at(high, x + margin_cells, y)
    window = 2 * margin_cells + 1
    return minimum_filter1d(low, window), maximum_filter1d(high, window) + 2 * margin_cells


@dataclass(frozen=True)
class UvLayout:
    """Uv layout of a mesh whose vertices are split at seams.

    uv : (v, 2) uv of each vertex, u to the right, v down
    triangles : (f, 3) vertex indices, in the order of the mesh's triangles
    point : (v,) index of the mesh point at which each vertex lies
    chart : (f,) chart of each triangle, numbered from 0
    """

    uv: Doubles
    triangles: Index
    point: Index
    chart: Index


def unwrap(
    positions: Doubles,
    triangles: Index,
    triangle_chart: Index,
    up_direction: ArrayLike = DEFAULT_UP_DIRECTION,
    padding: float = CHART_PADDING,
) -> UvLayout:
    """Unwrap a mesh into a uv layout in which no triangle is mirrored and no two triangles overlap.

    If a flattened chart has mirrored triangles, or its border crosses itself, the faulty triangles are moved
    to adjacent charts. A chart that is still faulty is split.

    positions : (n, 3) points of the mesh [mm]
    triangles : (f, 3) point indices; each triangle must have an area
    triangle_chart : (f,) desired chart of each triangle; a chart that is not connected becomes several charts
    up_direction : direction in space that points up on the map: (3,) for all triangles, or (f, 3) for each
        one
    padding : empty space between charts as a fraction of the map's side

    Raises DermisError if a triangle has no area or if there are too many charts for one map.
    """
    _check_triangle_areas(positions, triangles)
    flat = flatten_charts(ChartMesh(positions, triangles), triangle_chart)
    up = np.broadcast_to(np.asarray(up_direction, dtype=np.float64), (len(triangles), 3))
    first = np.unique(flat.chart, return_index=True)[1]
    height = np.einsum("fki,fi->fk", positions[triangles], up[first][flat.chart])
    uv = _packed_uv(_orient_charts(flat, height), flat, padding)
    return UvLayout(uv, flat.corners, flat.point, flat.chart)


def _check_triangle_areas(positions: Doubles, triangles: Index) -> None:
    degenerate = int((triangle_areas(positions[triangles]) < _MIN_TRIANGLE_AREA_MM2).sum())
    if degenerate:
        refuse("mesh", "triangles with an area", f"{degenerate} have none", "Remove them first")


def _orient_charts(flat_charts: FlatCharts, upright_coordinate: Doubles) -> Doubles:
    """Rotate each chart so that `upright_coordinate` increases upwards; return positions (v, 2).

    upright_coordinate : (f, 3) coordinate of each triangle corner along the up direction in space [mm]
    """
    z = flat_charts.uv_mm[:, 0] + 1j * flat_charts.uv_mm[:, 1]
    z3 = z[flat_charts.corners]
    # i times the edge opposite a corner is the direction of the gradient of its hat function
    slope = 1j * (upright_coordinate * (np.roll(z3, -2, axis=1) - np.roll(z3, -1, axis=1))).sum(axis=1)
    up = np.bincount(flat_charts.chart, slope.real) + 1j * np.bincount(flat_charts.chart, slope.imag)
    rotation = np.where(np.abs(up) > 0, 1j * np.conj(up) / np.maximum(np.abs(up), 1e-300), 1)
    z *= rotation[_vertex_charts(flat_charts)]
    return np.column_stack((z.real, z.imag))


def _vertex_charts(flat_charts: FlatCharts) -> Index:
    """Return the chart index of each vertex (v,)."""
    chart = np.empty(len(flat_charts.point), dtype=np.int64)
    chart[flat_charts.corners] = flat_charts.chart[:, None]
    return chart


def _packed_uv(uv_mm: Doubles, flat_charts: FlatCharts, padding: float) -> Doubles:
    """Pack the charts; return the uv (v, 2) of all vertices, v down.

    uv_mm : (v, 2) positions of the vertices in the flattened charts [mm]
    padding : empty space between charts as a fraction of the map's side
    """
    edges, triangle = border_edges(flat_charts.corners)
    chart = flat_charts.chart[triangle]
    order = np.argsort(chart, kind="stable")
    starts = np.flatnonzero(np.diff(chart[order])) + 1
    scale, offset = pack_charts([uv_mm[some] for some in np.split(edges[order], starts)], padding)
    uv = scale * uv_mm + offset[_vertex_charts(flat_charts)]
    return np.column_stack((uv[:, 0], 1 - uv[:, 1]))


def unwrap_mesh(mesh: Mesh) -> Mesh:
    """Return a mesh with a new uv layout of about 16 random charts; the old uv has no influence.

    The triangles and their order are unchanged. Triangles without an area have the uv (0, 0).
    """
    positions = np.zeros((int(mesh.point.max()) + 1, 3))
    positions[mesh.point] = mesh.positions
    points = mesh.point[mesh.triangles].astype(np.int64)
    valid = np.flatnonzero(triangle_areas(positions[points]) > _MIN_CHART_AREA_MM2)
    triangles = points[valid]
    layout = unwrap(
        positions,
        triangles,
        smooth_charts(grow_charts(positions, triangles, _DEFAULT_CHART_COUNT), triangles),
    )
    corner = np.full((len(points), 3), len(layout.uv), dtype=np.int64)
    corner[valid] = layout.triangles
    normals = np.zeros((len(positions), 3))
    normals[mesh.point] = mesh.normals
    point = np.append(layout.point, 0)
    uv = np.vstack([layout.uv, np.zeros(2)])
    return build_mesh(positions[point], uv, corner, mesh.material, mesh.materials, normals[point], point)
