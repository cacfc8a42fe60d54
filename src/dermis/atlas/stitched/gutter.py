"""Borders of pieces, the gutters around them, and the surface that continues there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index

_MOST_STRETCH = 2.0  # largest texels per mm of a border over its piece's mean, for gutter widths


class Border(NamedTuple):
    """Sides of triangles at which pieces end.

    triangle, side : (k,) triangle and which side of it
    seam : (k,) whether the surface goes on across it
    """

    triangle: Index
    side: Index
    seam: Flags


class Packing(NamedTuple):
    """Where triangles lie on a grid.

    places : (f, 3, 2) corners [texel], whole numbers at texel centres
    per_uv : (f,) texels in a unit of uv
    per_mm : (f,) texels in a mm of the surface, the mean over the piece
    """

    places: Doubles
    per_uv: Doubles
    per_mm: Doubles


class GutterWidth(NamedTuple):
    """How far gutters reach: on the surface [mm], and at most [texel]."""

    reach_mm: float
    widest: float


def find_border(surface: FlatSurface, piece: Index, own: Index) -> Border:
    """Where pieces end.

    piece : (f,) piece of each triangle, -1 for triangles that have no place
    own : triangles to examine, all of which have one
    """
    beside = surface.beside_uv[own]
    row, index = np.nonzero((beside == own[:, None]) | (piece[own, None] != piece[beside]))
    triangle = own[row]
    beyond = surface.adjacency.beside[triangle, index]
    return Border(triangle, index, (beyond >= 0) & surface.adjacency.free[beyond])


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


def sides_of(surface: FlatSurface, border: Border, packing: Packing, width: GutterWidth) -> Sides:
    """The sides of a border as they are placed."""
    triangle, both = border.triangle, (border.side, (border.side + 1) % 3)
    ends = np.stack([packing.places[triangle, k] for k in both], axis=1)
    steps = np.stack([surface.along[triangle, k] for k in both], axis=1)
    steps = steps / packing.per_uv[triangle][:, None, None, None]
    # slivers may be stretched a hundredfold: gutters that wide would waste room
    widest = np.minimum(width.widest, _MOST_STRETCH * width.reach_mm * packing.per_mm[triangle])
    return Sides(ends, steps, np.where(border.seam, width.reach_mm, 0.0), widest)


class NearestSides(NamedTuple):
    """For each texel of a grid (h, w) outside of pieces, the nearest place on a border.

    side, share : number of the side, -1 without one; how far along it, 0 to 1
    away_mm2 : squared distance by the metric that the surface has there
    rim : texels that interpolation at some place on a border reads
    """

    side: NDArray[np.int32]
    share: NDArray[np.float32]
    away_mm2: NDArray[np.float32]
    rim: Flags


def nearest_sides(sides: Sides, owner: NDArray[np.int32]) -> NearestSides:
    """The nearest side of each texel within reach.

    owner : (h, w) triangles of the pieces, -1 outside
    """
    from dermis.atlas.stitched.kernels.fill import nearest_side

    shape = owner.shape
    side, rim = np.full(shape, -1, np.int32), np.zeros(shape, np.bool_)
    share, away = np.zeros(shape, np.float32), np.full(shape, np.inf, np.float32)
    u, v = (np.ascontiguousarray(sides.steps[:, :, k]) for k in (0, 1))
    nearest_side(sides.ends, u, v, sides.reach_mm, sides.widest, owner, side, share, away, rim)
    return NearestSides(side, share, away, rim)


def needed(
    surface: FlatSurface,
    own: Index,
    border: Border,
    packing: Packing,
    width: GutterWidth,
    shape: tuple[int, int],
) -> Flags:
    """(h, w) texels that pieces, rims and gutters may need."""
    from dermis.atlas.stitched.kernels.fill import fill

    owner = np.full(shape, -1, np.int32)
    fill(packing.places, own, owner)
    return (owner >= 0) | (nearest_sides(sides_of(surface, border, packing, width), owner).side >= 0)


class GutterTexels(NamedTuple):
    """Texels (n,) outside of pieces that belong to the gutter of one.

    y, x : row and column
    rim : those that interpolation within the piece reads
    away_mm : distance from the piece
    root, root_weights : nearest place on its border: triangle, weights of the second and third corner
    triangle, weights : the same where a straight walk from there ends
    whole : whether the surface reaches that far
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


def walk_gutter(
    surface: FlatSurface, border: Border, packing: Packing, width: GutterWidth, owner: NDArray[np.int32]
) -> GutterTexels:
    """The surface beyond a border, on texels that no piece owns.

    owner : (h, w) triangles of the pieces, -1 outside
    """
    from dermis.atlas.stitched.kernels.walk import walk

    triangle, first = border.triangle, border.side
    second = (first + 1) % 3
    sides = sides_of(surface, border, packing, width)
    side, share, away, rim = nearest_sides(sides, owner)
    y, x = np.nonzero(side >= 0)
    k, t = side[y, x], share[y, x].astype(np.float64)[:, None]
    root = triangle[k].astype(np.int32)
    start = _between(surface.adjacency.flat[root, first[k]], surface.adjacency.flat[root, second[k]], t)
    off = np.column_stack((x, y)) - _between(sides.ends[k, 0], sides.ends[k, 1], t)
    target = start + np.einsum(
        "ns,nsa->na", off, _between(sides.steps[k, 0], sides.steps[k, 1], t[..., None])
    )
    found, weights, whole = np.empty(len(k), np.int32), np.empty((len(k), 2)), np.empty(len(k), np.bool_)
    walk(surface.adjacency, root, start, target, found, weights, whole)
    corner = np.zeros((len(k), 3))
    rows = np.arange(len(k))
    corner[rows, first[k]], corner[rows, second[k]] = 1 - t[:, 0], t[:, 0]
    return GutterTexels(y, x, rim[y, x], np.sqrt(away[y, x]), root, corner[:, 1:], found, weights, whole)


def _between(a: Doubles, b: Doubles, t: Doubles) -> Doubles:
    return np.asarray(a + (b - a) * t)
