"""Pieces: the charts of a mesh, those parts of them apart that lie folded onto each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.surface import Surface
from dermis.atlas.unwrap.charts import pieces as connected

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

_COLLAPSED = 0.05  # of the mesh's mean density: what has less holds nothing that could be blurred
_SPECK_MM2 = 1.0  # mirrored parts under this stay with the chart around them
_EVEN = (0.5, 1.4)  # of the mean density: charts that have more or less are moved halfway towards it


def find_pieces(surface: Surface) -> tuple[Index, Doubles]:
    """Piece of each triangle (f,), -1 without a place, and scale (f,) of its uv that evens out density."""
    mirrored = (surface.area_uv < 0).astype(np.int64)
    beside = surface.beside_uv
    chart = connected(np.zeros(len(mirrored), np.int64), beside)
    piece = connected(2 * chart + mirrored, beside)
    piece = _with_specks(surface, chart, piece)
    piece = np.where(surface.sound, piece, -1)
    density, mean = _density(surface, piece)
    piece[density < _COLLAPSED * mean] = -1
    density, mean = _density(surface, piece)
    low, high = (limit * mean for limit in _EVEN)
    wanted = np.where(density < low, np.sqrt(low * density), density)
    wanted = np.where(density > high, np.sqrt(high * density), wanted)
    return numbered(piece), np.where(piece >= 0, wanted / np.maximum(density, 1e-12), 1.0)


def numbered(piece: Index) -> Index:
    """The same pieces (f,), counted from 0; -1 stays."""
    numbers, again = np.unique(piece, return_inverse=True)
    return np.asarray(again.reshape(-1) - np.count_nonzero(numbers < 0), dtype=np.int64)


def _with_specks(surface: Surface, chart: Index, piece: Index) -> Index:
    """Pieces with the small ones given to the largest of their chart."""
    area = np.bincount(piece, surface.area_mm2 * surface.sound)
    order = np.argsort(area[piece], kind="stable")
    largest = np.zeros(int(chart.max()) + 1, np.int64)
    largest[chart[order]] = piece[order]
    return np.where(area[piece] < _SPECK_MM2, largest[chart], piece)


def _density(surface: Surface, piece: Index) -> tuple[Doubles, float]:
    """Side of each triangle's piece in uv over that in space (f,) [1/mm], and of all together."""
    inside, number = piece >= 0, np.maximum(piece, 0)
    uv = np.bincount(number, np.abs(surface.area_uv) * inside)
    mm2 = np.bincount(number, surface.area_mm2 * inside)
    mean = float(np.sqrt(uv.sum() / max(mm2.sum(), 1e-12)))
    return np.where(inside, np.sqrt(uv / np.maximum(mm2, 1e-12))[number], mean), mean
