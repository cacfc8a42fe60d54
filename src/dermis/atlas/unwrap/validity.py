"""Whether flattened sheets can carry maps: nothing mirrored, nothing overlapping."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.seams import border_sides
from dermis.mesh.geometry import uv_cross

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROWS = 256  # sides compared with all others at a time


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
