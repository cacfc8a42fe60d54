"""Seams of charts: borders, cuts along them, and charts split until they flatten well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.charts import across, grow, join_strays, neighbours
from dermis.atlas.unwrap.flatten import flatten, sheets
from dermis.mesh.geometry import uv_cross

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]
Flags = NDArray[np.bool_]
_ROWS = 256  # sides compared with all others at a time
_MENDINGS = 6  # of borders, before charts are halved


def border_sides(corner: Index) -> tuple[Index, Index]:
    """Sides (k, 2) that only one triangle has, counter-clockwise around it, and that triangle (k,)."""
    start, end = corner.T.ravel(), np.roll(corner, -1, axis=1).T.ravel()
    alone = np.flatnonzero(across(corner) == np.arange(len(start)))
    return np.column_stack((start, end))[alone], alone % len(corner)


def cut_open(triangles: Index, chart: Index) -> tuple[Index, Index]:
    """Corner vertices (f, 3) of each triangle, and the point (v,) that each of them is.

    Corners stay together where triangles of one chart meet along an edge.

    triangles : (f, 3) points
    chart : (f,)
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    f, other = len(triangles), across(triangles)
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    # sides that run the same way belong to sheets that face opposite ways
    side = np.arange(3 * f)
    joined = (start == end[other]) & (chart[side % f] == chart[other % f]) & (other != side)
    here, there = np.flatnonzero(joined), other[joined]
    after = (side + f) % (3 * f)  # the corner at a side's end is the start of the triangle's next
    one, two = np.concatenate((here, after[here])), np.concatenate((after[there], there))
    links = coo_array((np.ones(len(one)), (one, two)), shape=(3 * f, 3 * f))
    count, vertex = connected_components(links, directed=False)
    point = np.empty(count, dtype=np.int64)
    point[vertex] = start
    return vertex.reshape(3, f).T.astype(np.int64), point


def faults(places: Doubles, corner: Index, piece: Index) -> Flags:
    """Which triangles (f,) are mirrored or collapsed, or have a side on the border that crosses another.

    A piece without any does not overlap itself.

    places : (v, 2) x to the right, y up
    corner : (f, 3)
    piece : (f,) from 0
    """
    faulty: Flags = uv_cross(places[corner]) <= 0
    sides, owner = border_sides(corner)
    for k in range(int(piece.max()) + 1):
        own = np.flatnonzero(piece[owner] == k)
        faulty[owner[own[crossed(places[sides[own]])]]] = True
    return faulty


def crossed(sides: Doubles) -> Flags:
    """Which sides (k, 2, 2) cross others, other than at their ends."""
    found = np.zeros(len(sides), dtype=bool)
    for k in range(0, len(sides), _ROWS):
        found[k : k + _ROWS] = _crossing(sides[k : k + _ROWS], sides).any(axis=1)
    return found


def _crossing(some: Doubles, sides: Doubles) -> Flags:
    a, b = some[:, None, 0], some[:, None, 1]
    c, d = sides[None, :, 0], sides[None, :, 1]
    apart = _side(a, b, c) * _side(a, b, d) < 0
    crossing: Flags = apart & (_side(c, d, a) * _side(c, d, b) < 0)
    return crossing


def _side(a: Doubles, b: Doubles, p: Doubles) -> Doubles:
    """Twice the area of the triangles a, b, p: positive where p is to the left of ab."""
    ab, ap = b - a, p - a
    area: Doubles = ab[..., 0] * ap[..., 1] - ab[..., 1] * ap[..., 0]
    return area


class Flat(NamedTuple):
    """Charts laid flat.

    corner : (f, 3) corner vertices of each triangle
    point : (v,) point that each of them is
    places : (v, 2) x to the right and y up, each chart about the origin of its own
    piece : (f,) chart in one piece that each triangle belongs to, from 0
    faulty : (f,) triangles that are mirrored, or lie over others where the border crosses itself
    """

    corner: Index
    point: Index
    places: Doubles
    piece: Index
    faulty: Flags


class Surface(NamedTuple):
    """The triangles to lay flat; see `unwrap.unwrap`."""

    positions: Doubles
    triangles: Index

    def lay(self, chart: Index) -> Flat:
        """Its charts (f,) laid flat, faulty or not."""
        corner, point = cut_open(self.triangles, chart)
        even = np.ones(len(corner))
        places = flatten(self.positions[point], corner, even, even)
        piece = sheets(corner, len(point))[corner[:, 0]]
        return Flat(corner, point, places, piece, faults(places, corner, piece))

    def part(self, chosen: Flags) -> Surface:
        """Some of its triangles."""
        return Surface(self.positions, self.triangles[chosen])


def lay_flat(surface: Surface, chart: Index) -> Flat:
    """The charts (f,) laid flat without a fault, after as little change to them as that takes."""
    flat = surface.lay(chart)
    while flat.faulty.any():
        flat = surface.lay(_settle(surface, flat, 0))
    return flat


def _settle(surface: Surface, flat: Flat, turn: int) -> Index:
    """Charts (f,) that are flat without a fault: borders mended at first, then charts halved."""
    if not flat.faulty.any():
        return flat.piece
    chart = _hand_over(surface, flat) if turn < _MENDINGS else _halve(surface, flat)
    changed = flat.faulty | (chart != flat.piece)
    touched = np.isin(flat.piece, flat.piece[changed]) | np.isin(chart, chart[changed])
    part = surface.part(touched)
    chart[touched] = chart.max() + 1 + _settle(part, part.lay(chart[touched]), turn + 1)
    return chart


def _hand_over(surface: Surface, flat: Flat) -> Index:
    """Charts with faulty triangles given to the chart beside them, where there is one."""
    beside = flat.piece[neighbours(surface.triangles)]
    other = np.where(beside == flat.piece[:, None], -1, beside).max(axis=1)
    return join_strays(np.where(flat.faulty & (other >= 0), other, flat.piece), surface.triangles)


def _halve(surface: Surface, flat: Flat) -> Index:
    """Charts with each faulty one grown anew as two."""
    chart = 2 * flat.piece
    for k in np.unique(flat.piece[flat.faulty]):
        own = np.flatnonzero(flat.piece == k)
        chart[own] += np.minimum(grow(surface.positions, surface.triangles[own], 2), 1)
    return chart
