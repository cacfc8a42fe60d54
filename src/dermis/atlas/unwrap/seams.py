"""Seams of charts: border edges, split vertices, and repair of charts that overlap when flattened."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.unwrap.charts import grow_charts, merge_stray_pieces, neighbour_triangles, opposite_sides
from dermis.atlas.unwrap.flatten import flatten, vertex_components
from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import cross_2d, label_components, uv_cross

_EDGES_PER_BLOCK = 256  # number of edges that are compared with all other edges at a time
_MAX_REASSIGNMENTS = 6  # number of moves of faulty triangles to adjacent charts before charts are split


def border_edges(triangles: Index) -> tuple[Index, Index]:
    """Return border edges (k, 2), counter-clockwise around their only triangle, and this triangle (k,)."""
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    alone = np.flatnonzero(opposite_sides(triangles) == np.arange(len(start)))
    return np.column_stack((start, end))[alone], alone % len(triangles)


def split_at_seams(triangles: Index, triangle_chart: Index) -> tuple[Index, Index]:
    """Split vertices at seams; return new vertex indices (f, 3), and the old index of each new vertex (v,).

    Afterwards, two triangles share the vertices of their common edge only if they belong to the same chart.

    triangles : (f, 3) old vertex indices
    triangle_chart : (f,) chart of each triangle
    """
    f, other = len(triangles), opposite_sides(triangles)
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    # sides in the same direction belong to triangles of opposite orientation
    side = np.arange(3 * f)
    joined = (start == end[other]) & (triangle_chart[side % f] == triangle_chart[other % f]) & (other != side)
    here, there = np.flatnonzero(joined), other[joined]
    after = (side + f) % (3 * f)  # index of the corner at the end of a side
    one, two = np.concatenate((here, after[here])), np.concatenate((after[there], there))
    vertex = label_components(3 * f, one, two)
    point = np.empty(int(vertex.max(initial=-1)) + 1, dtype=np.int64)
    point[vertex] = start
    return vertex.reshape(3, f).T, point


def faulty_triangles(positions: Doubles, triangles: Index, triangle_chart: Index) -> Mask:
    """Return the mask (f,) of triangles that are mirrored, collapsed, or at a self-crossing of the border.

    A chart without such triangles does not overlap itself.

    positions : (v, 2) vertices, x to the right, y up
    triangles : (f, 3) vertex indices
    triangle_chart : (f,) chart of each triangle, numbered from 0
    """
    faulty: Mask = uv_cross(positions[triangles]) <= 0
    sides, owner = border_edges(triangles)
    for k in range(int(triangle_chart.max()) + 1):
        own = np.flatnonzero(triangle_chart[owner] == k)
        faulty[owner[own[crossing_edges(positions[sides[own]])]]] = True
    return faulty


def crossing_edges(edges: Doubles) -> Mask:
    """Return the mask (k,) of edges that cross another edge at a point between the ends of both edges.

    edges : (k, 2, 2) end points of the edges
    """
    found = np.zeros(len(edges), dtype=bool)
    for k in range(0, len(edges), _EDGES_PER_BLOCK):
        found[k : k + _EDGES_PER_BLOCK] = _pairs_cross(edges[k : k + _EDGES_PER_BLOCK], edges).any(axis=1)
    return found


def _pairs_cross(edge_block: Doubles, edges: Doubles) -> Mask:
    a, b = edge_block[:, None, 0], edge_block[:, None, 1]
    c, d = edges[None, :, 0], edges[None, :, 1]
    straddle = cross_2d(b - a, c - a) * cross_2d(b - a, d - a) < 0
    return np.asarray(straddle & (cross_2d(d - c, a - c) * cross_2d(d - c, b - c) < 0))


class FlatCharts(NamedTuple):
    """Charts flattened into the plane, before they are packed.

    corners : (f, 3) vertex indices of each triangle
    point : (v,) index of the mesh point at which each vertex lies
    uv_mm : (v, 2) positions, x to the right and y up, each chart with its own origin [mm]
    chart : (f,) index of each triangle's chart from 0; each chart is connected
    faulty : (f,) mask of triangles that are mirrored, collapsed, or at a self-crossing of the chart's border
    """

    corners: Index
    point: Index
    uv_mm: Doubles
    chart: Index
    faulty: Mask


class ChartMesh(NamedTuple):
    """Triangles (f, 3) to flatten, and the positions (n, 3) of their vertices [mm]."""

    positions: Doubles
    triangles: Index

    def flatten(self, triangle_chart: Index) -> FlatCharts:
        """Flatten charts, and mark the faulty triangles as described in `FlatCharts`.

        triangle_chart : (f,) chart of each triangle

        A closed piece of a chart, which has no border, is opened: its first triangle becomes a chart.
        """
        corners, point = split_at_seams(self.triangles, triangle_chart)
        piece = vertex_components(corners, len(point))[corners[:, 0]]
        closed = np.setdiff1d(piece, piece[border_edges(corners)[1]])
        if len(closed):
            opened, first = triangle_chart.copy(), np.unique(piece, return_index=True)[1]
            opened[first[closed]] = triangle_chart.max() + 1 + np.arange(len(closed))
            return self.flatten(opened)
        ones = np.ones(len(corners))
        uv_mm = flatten(self.positions[point], corners, ones, ones)
        return FlatCharts(corners, point, uv_mm, piece, faulty_triangles(uv_mm, corners, piece))

    def subset(self, triangle_mask: Mask) -> ChartMesh:
        """Return the mesh of the triangles that a mask selects."""
        return ChartMesh(self.positions, self.triangles[triangle_mask])


def flatten_charts(mesh: ChartMesh, triangle_chart: Index) -> FlatCharts:
    """Flatten charts, and change the division into charts until no triangle is faulty.

    Faulty triangles are mirrored or collapsed, or the border of their chart crosses itself there.

    triangle_chart : (f,) chart of each triangle
    """
    flat = mesh.flatten(triangle_chart)
    while flat.faulty.any():
        flat = mesh.flatten(_repair_charts(mesh, flat, 0))
    return flat


def _repair_charts(mesh: ChartMesh, flat_charts: FlatCharts, repair_count: int) -> Index:
    """Return the chart of each triangle (f,) after a repair of charts with faulty triangles.

    Faulty triangles are those in the mask `FlatCharts.faulty`. The first repairs move them to adjacent
    charts; later repairs split the charts.

    repair_count : number of repairs made so far
    """
    if not flat_charts.faulty.any():
        return flat_charts.chart
    chart = (
        _reassign_faulty_triangles(mesh, flat_charts)
        if repair_count < _MAX_REASSIGNMENTS
        else _split_faulty_charts(mesh, flat_charts)
    )
    changed = flat_charts.faulty | (chart != flat_charts.chart)
    affected = np.isin(flat_charts.chart, flat_charts.chart[changed]) | np.isin(chart, chart[changed])
    subset = mesh.subset(affected)
    chart[affected] = (
        chart.max() + 1 + _repair_charts(subset, subset.flatten(chart[affected]), repair_count + 1)
    )
    return chart


def _reassign_faulty_triangles(mesh: ChartMesh, flat_charts: FlatCharts) -> Index:
    """Move each faulty triangle that has an adjacent chart to that chart; return each triangle's chart (f,).

    `FlatCharts.faulty` states which triangles are faulty.
    """
    adjacent = flat_charts.chart[neighbour_triangles(mesh.triangles)]
    other = np.where(adjacent == flat_charts.chart[:, None], -1, adjacent).max(axis=1)
    return merge_stray_pieces(
        np.where(flat_charts.faulty & (other >= 0), other, flat_charts.chart), mesh.triangles
    )


def _split_faulty_charts(mesh: ChartMesh, flat_charts: FlatCharts) -> Index:
    """Split each chart that contains faulty triangles in two; return the chart of each triangle (f,).

    `FlatCharts.faulty` states which triangles are faulty.
    """
    chart = 2 * flat_charts.chart
    for k in np.unique(flat_charts.chart[flat_charts.faulty]):
        own = np.flatnonzero(flat_charts.chart == k)
        chart[own] += np.minimum(grow_charts(mesh.positions, mesh.triangles[own], 2), 1)
    return chart
