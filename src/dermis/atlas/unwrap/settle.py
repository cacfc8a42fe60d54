"""Charts changed until each of them can be laid flat."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.charts import grow, join_strays, neighbours
from dermis.atlas.unwrap.flatten import flatten, sheets
from dermis.atlas.unwrap.seams import cut_open
from dermis.atlas.unwrap.validity import faults

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MENDINGS = 6  # of borders, before charts are halved


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
