"""Eyebrows and lashes as single hairs, drawn on the skin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from dermis.human.bust import eyes
from dermis.human.bust.anatomy import nominal
from dermis.human.bust.fields import Doubles

_BROW_HAIRS, _LASHES = 1100, 130
WIDEST_TEXEL_MM = 0.8
"""Wider texels see hairs as if they were of this width [mm]."""
_PIECES = 4
_CELL_MM = 1.5
_INNER_X, _OUTER_X = 11.0, 51.5
# Artist's values along the brow, from its inner to its outer end: height of its middle over the landmark,
# half of its height, direction of its hairs above outwards, and how dense they stand.
_ALONG = np.array([0.0, 0.1, 0.25, 0.45, 0.65, 0.85, 1.0])
_MIDDLE = np.array([-3.2, -2.6, -1.3, 0.2, 1.1, -0.1, -2.4])
_HALF = np.array([3.4, 4.4, 4.6, 4.2, 3.4, 2.6, 1.7])
_TURN = np.radians([88, 70, 42, 18, -2, -22, -32])
_DENSITY = np.array([0.25, 0.6, 0.95, 1.0, 1.0, 0.8, 0.45])


class Hairs(NamedTuple):
    """Straight pieces of hairs over the front plane, sorted into square cells.

    pieces : (k, 7) ends x, y, x, y, half-widths at both, and opacity; places on the symmetric head [mm]
    first : (cells + 1,) where in `members` each cell begins
    members : (m,) pieces in reach of each cell
    left_mm, bottom_mm, cell_mm, columns, lines : of the cells
    """

    pieces: Doubles
    first: NDArray[np.int64]
    members: NDArray[np.int64]
    left_mm: float
    bottom_mm: float
    cell_mm: float
    columns: int
    lines: int


def make_hairs(seed: int) -> Hairs:
    """The hairs of both sides."""
    sides = []
    for side in (1.0, -1.0):
        rng = np.random.default_rng((seed, int(side > 0)))
        both = np.concatenate((_brow(rng), _lashes(rng)))
        sides.append(both * np.array([side, 1, side, 1, 1, 1, 1]))
    return _sorted(np.concatenate(sides), reach_mm=0.1 + WIDEST_TEXEL_MM)


def _brow(rng: Generator) -> Doubles:
    """Pieces of one brow, left."""
    u = rng.random(3 * _BROW_HAIRS)
    u = u[rng.random(len(u)) < np.interp(u, _ALONG, _DENSITY)][:_BROW_HAIRS]
    v = np.clip(rng.normal(0.0, 0.65, len(u)), -1.4, 1.4)
    x = _INNER_X + (_OUTER_X - _INNER_X) * u + rng.normal(0, 0.4, len(u))
    y = nominal("brow")[1] + np.interp(u, _ALONG, _MIDDLE) + v * np.interp(u, _ALONG, _HALF)
    # hairs from below and from above lean together
    turn = np.interp(u, _ALONG, _TURN) - 0.45 * v * np.minimum(1.6 * u, 1) + rng.normal(0, 0.13, len(u))
    length = np.interp(u, (0, 0.3, 1), (5.0, 8.0, 5.0)) * rng.uniform(0.65, 1.15, len(u))
    bend = -0.55 * np.sign(np.sin(turn)) * np.minimum(np.abs(turn), 0.6) + rng.normal(0, 0.1, len(u))
    opacity = rng.uniform(0.4, 0.85, len(u)) * np.exp(-0.4 * v * v)
    return _strands(x, y, turn, bend, length, np.full(len(u), 0.1), opacity)


def _lashes(rng: Generator) -> Doubles:
    """Pieces of the lashes of one upper lid, left, on the skin below it."""
    u = np.sort(rng.random(_LASHES))
    x = np.interp(u, (0, 1), (19.0, 45.0))
    y = np.interp(x, eyes.LINES[:, 0], eyes.LINES[:, 1]) - 0.4
    turn = np.radians(np.interp(u, (0, 0.5, 1), (-112, -88, -42))) + rng.normal(0, 0.14, len(u))
    length = np.interp(u, (0, 0.7, 1), (1.6, 3.6, 3.2)) * rng.uniform(0.6, 1.1, len(u))
    bend = np.full(len(u), 0.35) * np.sign(u - 0.35)
    opacity = rng.uniform(0.4, 0.75, len(u))
    return _strands(x, y, turn, bend, length, np.full(len(u), 0.075), opacity)


def _strands(
    x: Doubles, y: Doubles, turn: Doubles, bend: Doubles, length: Doubles, width: Doubles, opacity: Doubles
) -> Doubles:
    """Pieces of hairs from roots (n,), each a bent line that thins out.

    turn, bend : direction at the root, and by how much it changes to the tip [rad]
    """
    steps = (np.arange(_PIECES) + 0.5) / _PIECES
    angle = turn[:, None] + bend[:, None] * steps
    step = (length / _PIECES)[:, None]
    along_x, along_y = (np.cumsum(step * f(angle), axis=1) for f in (np.cos, np.sin))
    knots_x, knots_y = (
        np.column_stack((root, root[:, None] + run)) for root, run in ((x, along_x), (y, along_y))
    )
    thin = width[:, None] * np.linspace(1.0, 0.35, _PIECES + 1)
    ends = [knots_x[:, :-1], knots_y[:, :-1], knots_x[:, 1:], knots_y[:, 1:], thin[:, :-1], thin[:, 1:]]
    ends.append(np.repeat(opacity[:, None], _PIECES, axis=1))
    return np.stack(ends, axis=-1).reshape(-1, 7)


def _sorted(pieces: Doubles, reach_mm: float) -> Hairs:
    """The pieces in cells, each piece in all that it may touch."""
    low = np.minimum(pieces[:, :2], pieces[:, 2:4]) - reach_mm
    high = np.maximum(pieces[:, :2], pieces[:, 2:4]) + reach_mm
    corner = low.min(axis=0)
    start, end = (((ends - corner) // _CELL_MM).astype(np.int64) for ends in (low, high))
    columns, lines = (int(n) + 1 for n in end.max(axis=0))
    cells = [
        (line * columns + column, piece)
        for piece, ((left, bottom), (right, top)) in enumerate(zip(start, end, strict=True))
        for line in range(bottom, top + 1)
        for column in range(left, right + 1)
    ]
    cell, member = np.array(sorted(cells), dtype=np.int64).T
    first = np.searchsorted(cell, np.arange(columns * lines + 1))
    left, bottom = (float(x) for x in corner)
    return Hairs(pieces, first, np.ascontiguousarray(member), left, bottom, _CELL_MM, columns, lines)
