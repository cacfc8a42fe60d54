"""Where pieces end, and which texels beyond belong to which side of a border."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.surface import Surface

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

_MOST_STRETCH = 2.0  # of a border's texels per mm over the mean of its piece, for the width of its gutter


class Border(NamedTuple):
    """Sides of triangles at which pieces end.

    triangle, side : (k,) triangle and which side of it
    seam : (k,) whether the surface goes on across it
    """

    triangle: Index
    side: Index
    seam: Flags


class Placing(NamedTuple):
    """Where triangles lie on a grid.

    places : (f, 3, 2) corners [texel], whole numbers at texel centres
    per_uv : (f,) texels in a unit of uv
    per_mm : (f,) texels in a mm of the surface, the mean over the piece
    """

    places: Doubles
    per_uv: Doubles
    per_mm: Doubles


class Gutter(NamedTuple):
    """How far gutters reach: on the surface [mm], and at most [texel]."""

    reach_mm: float
    widest: float


def find_border(surface: Surface, piece: Index, own: Index) -> Border:
    """Where pieces end.

    piece : (f,) piece of each triangle, -1 for triangles that have no place
    own : those to be looked at, all of which have one
    """
    beside = surface.beside_uv[own]
    row, index = np.nonzero((beside == own[:, None]) | (piece[own, None] != piece[beside]))
    triangle = own[row]
    beyond = surface.ground.beside[triangle, index]
    return Border(triangle, index, (beyond >= 0) & surface.ground.free[beyond])


class Sides(NamedTuple):
    """The sides of a border on a grid.

    ends : (k, 2, 2) [texel]
    steps : (k, 2, 2, 2) on the surface, at both ends, for a texel to the right and for one down [mm]
    reach_mm : (k,) how far texels beyond it belong to it
    widest : (k,) and how far at most [texel]
    """

    ends: Doubles
    steps: Doubles
    reach_mm: Doubles
    widest: Doubles


def sides_of(surface: Surface, border: Border, placing: Placing, width: Gutter) -> Sides:
    """The sides of a border as they are placed."""
    triangle, both = border.triangle, (border.side, (border.side + 1) % 3)
    ends = np.stack([placing.places[triangle, k] for k in both], axis=1)
    steps = np.stack([surface.along[triangle, k] for k in both], axis=1)
    steps = steps / placing.per_uv[triangle][:, None, None, None]
    # slivers may be stretched a hundredfold: what lies beyond them is not worth so much room
    widest = np.minimum(width.widest, _MOST_STRETCH * width.reach_mm * placing.per_mm[triangle])
    return Sides(ends, steps, np.where(border.seam, width.reach_mm, 0.0), widest)


class Claims(NamedTuple):
    """For each texel of a grid (h, w) outside of pieces, the place on a border that it is nearest to.

    side, share : number of the side, -1 without one; how far along it, 0 to 1
    away_mm2 : squared distance by the metric that the surface has there
    rim : texels that interpolation at some place on a border reads
    """

    side: NDArray[np.int32]
    share: NDArray[np.float32]
    away_mm2: NDArray[np.float32]
    rim: Flags


def claimed(sides: Sides, owner: NDArray[np.int32]) -> Claims:
    """Which texels belong to which side.

    owner : (h, w) triangles of the pieces, -1 outside
    """
    from dermis.atlas.stitched.kernels.claim import claim

    shape = owner.shape
    side, rim = np.full(shape, -1, np.int32), np.zeros(shape, np.bool_)
    share, away = np.zeros(shape, np.float32), np.full(shape, np.inf, np.float32)
    u, v = (np.ascontiguousarray(sides.steps[:, :, k]) for k in (0, 1))
    claim(sides.ends, u, v, sides.reach_mm, sides.widest, owner, side, share, away, rim)
    return Claims(side, share, away, rim)


def needed(
    surface: Surface, own: Index, border: Border, placing: Placing, width: Gutter, shape: tuple[int, int]
) -> Flags:
    """(h, w) texels that pieces, rims and gutters may need."""
    from dermis.atlas.stitched.kernels.fill import fill

    owner = np.full(shape, -1, np.int32)
    fill(placing.places, own, owner)
    return (owner >= 0) | (claimed(sides_of(surface, border, placing, width), owner).side >= 0)
