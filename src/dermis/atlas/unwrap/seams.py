"""Seams of charts: border edges, vertices split at seams, and charts split until they flatten well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.unwrap.charts import grow_charts, merge_strays, neighbours, opposite_sides
from dermis.atlas.unwrap.flatten import flatten, vertex_components
from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import components, cross_2d, uv_cross

_BLOCK = 256  # edges that are compared with all others at a time
_MAX_REASSIGNMENTS = 6  # of faulty triangles to neighbouring charts, before charts are split


def border_edges(corners: Index) -> tuple[Index, Index]:
    """Return the edges (k, 2) of only one triangle, counter-clockwise around it, and that triangle (k,)."""
    start, end = corners.T.ravel(), np.roll(corners, -1, axis=1).T.ravel()
    alone = np.flatnonzero(opposite_sides(corners) == np.arange(len(start)))
    return np.column_stack((start, end))[alone], alone % len(corners)


def split_at_seams(triangles: Index, chart: Index) -> tuple[Index, Index]:
    """Split points at seams: return the vertices (f, 3) of each triangle, and each vertex's point (v,).

    Two triangles share the vertices of an edge if they belong to one chart.

    triangles : (f, 3) points
    chart : (f,)
    """
    f, other = len(triangles), opposite_sides(triangles)
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    # sides in the same direction belong to triangles of opposite orientation
    side = np.arange(3 * f)
    joined = (start == end[other]) & (chart[side % f] == chart[other % f]) & (other != side)
    here, there = np.flatnonzero(joined), other[joined]
    after = (side + f) % (3 * f)  # index of the corner at the end of a side
    one, two = np.concatenate((here, after[here])), np.concatenate((after[there], there))
    vertex = components(3 * f, one, two)
    point = np.empty(int(vertex.max(initial=-1)) + 1, dtype=np.int64)
    point[vertex] = start
    return vertex.reshape(3, f).T, point


def faulty_triangles(positions: Doubles, corners: Index, chart: Index) -> Mask:
    """Return the mask (f,) of mirrored or collapsed triangles, and of those at crossings of a chart's border.

    A chart without any does not overlap itself.

    positions : (v, 2) x to the right, y up
    corners : (f, 3)
    chart : (f,) numbered from 0
    """
    faulty: Mask = uv_cross(positions[corners]) <= 0
    sides, owner = border_edges(corners)
    for k in range(int(chart.max()) + 1):
        own = np.flatnonzero(chart[owner] == k)
        faulty[owner[own[crossing_edges(positions[sides[own]])]]] = True
    return faulty


def crossing_edges(edges: Doubles) -> Mask:
    """Return the mask (k,) of edges (k, 2, 2) that cross others, other than at their ends."""
    found = np.zeros(len(edges), dtype=bool)
    for k in range(0, len(edges), _BLOCK):
        found[k : k + _BLOCK] = _pairs_cross(edges[k : k + _BLOCK], edges).any(axis=1)
    return found


def _pairs_cross(some: Doubles, edges: Doubles) -> Mask:
    a, b = some[:, None, 0], some[:, None, 1]
    c, d = edges[None, :, 0], edges[None, :, 1]
    straddle = cross_2d(b - a, c - a) * cross_2d(b - a, d - a) < 0
    return np.asarray(straddle & (cross_2d(d - c, a - c) * cross_2d(d - c, b - c) < 0))


class FlatCharts(NamedTuple):
    """Flattened charts.

    corners : (f, 3) vertices of each triangle
    point : (v,) point of the mesh that each vertex is at
    uv_mm : (v, 2) x to the right and y up, each chart with an origin of its own [mm]
    chart : (f,) connected chart of each triangle, numbered from 0
    faulty : (f,) triangles that are mirrored, or overlap others where the border crosses itself
    """

    corners: Index
    point: Index
    uv_mm: Doubles
    chart: Index
    faulty: Mask


class Triangles(NamedTuple):
    """Positions (n, 3) [mm] and triangles (f, 3) that are to be flattened."""

    positions: Doubles
    triangles: Index

    def flatten(self, chart: Index) -> FlatCharts:
        """Return the charts (f,) flattened, with or without faults."""
        corners, point = split_at_seams(self.triangles, chart)
        ones = np.ones(len(corners))
        uv_mm = flatten(self.positions[point], corners, ones, ones)
        piece = vertex_components(corners, len(point))[corners[:, 0]]
        return FlatCharts(corners, point, uv_mm, piece, faulty_triangles(uv_mm, corners, piece))

    def subset(self, chosen: Mask) -> Triangles:
        """Return the chosen triangles."""
        return Triangles(self.positions, self.triangles[chosen])


def flatten_charts(mesh: Triangles, chart: Index) -> FlatCharts:
    """Return the charts (f,) flattened without faults, with as few changes of the charts as possible."""
    flat = mesh.flatten(chart)
    while flat.faulty.any():
        flat = mesh.flatten(_repair(mesh, flat, 0))
    return flat


def _repair(mesh: Triangles, flat: FlatCharts, depth: int) -> Index:
    """Return charts (f,) that flatten without faults.

    At first faulty triangles are moved to adjacent charts, later charts are split.
    """
    if not flat.faulty.any():
        return flat.chart
    chart = _give_to_neighbours(mesh, flat) if depth < _MAX_REASSIGNMENTS else _split_faulty(mesh, flat)
    changed = flat.faulty | (chart != flat.chart)
    affected = np.isin(flat.chart, flat.chart[changed]) | np.isin(chart, chart[changed])
    subset = mesh.subset(affected)
    chart[affected] = chart.max() + 1 + _repair(subset, subset.flatten(chart[affected]), depth + 1)
    return chart


def _give_to_neighbours(mesh: Triangles, flat: FlatCharts) -> Index:
    """Return charts in which faulty triangles belong to an adjacent chart, if there is one."""
    adjacent = flat.chart[neighbours(mesh.triangles)]
    other = np.where(adjacent == flat.chart[:, None], -1, adjacent).max(axis=1)
    return merge_strays(np.where(flat.faulty & (other >= 0), other, flat.chart), mesh.triangles)


def _split_faulty(mesh: Triangles, flat: FlatCharts) -> Index:
    """Return charts in which each faulty chart is split in two."""
    chart = 2 * flat.chart
    for k in np.unique(flat.chart[flat.faulty]):
        own = np.flatnonzero(flat.chart == k)
        chart[own] += np.minimum(grow_charts(mesh.positions, mesh.triangles[own], 2), 1)
    return chart
