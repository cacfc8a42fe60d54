"""What texels outside of pieces show: the surface as it goes on beyond the border."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.border import Border, Gutter, Placing, claimed, sides_of
from dermis.atlas.stitched.surface import Surface

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Beyond(NamedTuple):
    """Texels (n,) outside of pieces that belong to one.

    y, x : row and column
    rim : those that interpolation within the piece reads
    away_mm : distance from the piece
    root, root_weights : nearest place on its border: triangle, weights of the second and third corner
    triangle, weights : the same where a straight walk from there ends
    whole : whether the surface goes on so far
    """

    y: Index
    x: Index
    rim: Flags
    away_mm: Doubles
    root: NDArray[np.int32]
    root_weights: Doubles
    triangle: NDArray[np.int32]
    weights: Doubles
    whole: Flags


def walk_beyond(
    surface: Surface, border: Border, placing: Placing, width: Gutter, owner: NDArray[np.int32]
) -> Beyond:
    """The surface beyond a border, on texels that no piece owns.

    owner : (h, w) triangles of the pieces, -1 outside
    """
    from dermis.atlas.stitched.kernels.walk import walk

    triangle, first = border.triangle, border.side
    second = (first + 1) % 3
    sides = sides_of(surface, border, placing, width)
    side, share, away, rim = claimed(sides, owner)
    y, x = np.nonzero(side >= 0)
    k, t = side[y, x], share[y, x].astype(np.float64)[:, None]
    root = triangle[k].astype(np.int32)
    start = _between(surface.ground.flat[root, first[k]], surface.ground.flat[root, second[k]], t)
    off = np.column_stack((x, y)) - _between(sides.ends[k, 0], sides.ends[k, 1], t)
    target = start + np.einsum(
        "ns,nsa->na", off, _between(sides.steps[k, 0], sides.steps[k, 1], t[..., None])
    )
    found, weights, whole = np.empty(len(k), np.int32), np.empty((len(k), 2)), np.empty(len(k), np.bool_)
    walk(surface.ground, root, start, target, found, weights, whole)
    corner = np.zeros((len(k), 3))
    rows = np.arange(len(k))
    corner[rows, first[k]], corner[rows, second[k]] = 1 - t[:, 0], t[:, 0]
    return Beyond(y, x, rim[y, x], np.sqrt(away[y, x]), root, corner[:, 1:], found, weights, whole)


def _between(a: Doubles, b: Doubles, t: Doubles) -> Doubles:
    return np.asarray(a + (b - a) * t)
