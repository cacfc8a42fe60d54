"""Borders of pieces, the gutters around them, and the surface that continues there."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import covered_texels
from dermis.atlas.stitched.geodesics import GeodesicEnds, trace_geodesics
from dermis.atlas.stitched.nearest import BorderSides, NearestPoints, nearest_border_points
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
    texels_per_uv: Doubles
    per_mm: Doubles


class GutterWidth(NamedTuple):
    """How far gutters reach: on the surface [mm], and at most [texel]."""

    gutter_mm: float
    max_texels: float


def find_border(surface: FlatSurface, piece: Index, own: Index) -> Border:
    """Where pieces end.

    piece : (f,) piece of each triangle, -1 for triangles that have no place
    own : triangles to examine, all of which have one
    """
    neighbour = surface.uv_neighbour[own]
    row, index = np.nonzero((neighbour == own[:, None]) | (piece[own, None] != piece[neighbour]))
    triangle = own[row]
    beyond = surface.adjacency.neighbour[triangle, index]
    return Border(triangle, index, (beyond >= 0) & surface.adjacency.passable[beyond])


def border_sides(surface: FlatSurface, border: Border, packing: Packing, width: GutterWidth) -> BorderSides:
    """The sides of a border as they are placed."""
    triangle, both = border.triangle, (border.side, (border.side + 1) % 3)
    ends = np.stack([packing.corners[triangle, k] for k in both], axis=1)
    steps = np.stack([surface.uv_steps[triangle, k] for k in both], axis=1)
    steps = steps / packing.texels_per_uv[triangle][:, None, None, None]
    # slivers may be stretched a hundredfold: gutters that wide would waste room
    max_texels = np.minimum(width.max_texels, _MOST_STRETCH * width.gutter_mm * packing.per_mm[triangle])
    return BorderSides(ends, steps, np.where(border.seam, width.gutter_mm, 0.0), max_texels)


def needed_texels(
    surface: FlatSurface,
    own: Index,
    border: Border,
    packing: Packing,
    width: GutterWidth,
    shape: tuple[int, int],
) -> Flags:
    """(h, w) texels that pieces, rims and gutters may need."""
    found = np.zeros(shape, np.bool_)
    found.ravel()[covered_texels(packing.corners[own], shape)[0]] = True
    found.ravel()[nearest_border_points(border_sides(surface, border, packing, width), found).texel] = True
    return found


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
    distance_mm: Doubles
    root: NDArray[np.int32]
    root_weights: Doubles
    triangle: NDArray[np.int32]
    weights: Doubles
    complete: Flags


def trace_gutter(
    surface: FlatSurface, border: Border, packing: Packing, width: GutterWidth, owner: NDArray[np.int32]
) -> GutterTexels:
    """The surface beyond a border, on texels that no piece owns.

    owner : (h, w) triangles of the pieces, -1 outside
    """
    nearest = nearest_border_points(sides := border_sides(surface, border, packing, width), owner >= 0)
    texels = np.column_stack(np.divmod(nearest.texel, owner.shape[1])[::-1])
    ends, weights = trace_from_border(surface, border, sides, nearest, texels)
    y, x = texels.T[::-1]
    root = border.triangle[nearest.side].astype(np.int32)
    return GutterTexels(y, x, nearest.rim, nearest.distance_mm, root, weights, *ends)


def trace_from_border(
    surface: FlatSurface, border: Border, sides: BorderSides, nearest: NearestPoints, texels: NDArray[Any]
) -> tuple[GeodesicEnds, Doubles]:
    """Where straight walks to texels (n, 2) from the nearest places on a border end, and weights of these."""
    t, root = nearest.share[:, None], border.triangle[nearest.side]
    first, rows = border.side[nearest.side], np.arange(len(root))
    second = (first + 1) % 3
    start = _between(surface.adjacency.flat[root, first], surface.adjacency.flat[root, second], t)
    off = texels - border_points(sides, nearest)
    step = np.einsum("ns,nsa->na", off, border_steps(sides, nearest))
    corner = np.zeros((len(root), 3))
    corner[rows, first], corner[rows, second] = 1 - t[:, 0], t[:, 0]
    return trace_geodesics(surface.adjacency, root, start, start + step), corner[:, 1:]


def border_points(sides: BorderSides, nearest: NearestPoints) -> Doubles:
    """(n, 2) the nearest places [texel]."""
    first, second = np.moveaxis(sides.ends[nearest.side], 1, 0)
    return _between(first, second, nearest.share[:, None])


def border_steps(sides: BorderSides, nearest: NearestPoints) -> Doubles:
    """(n, 2, 2) steps on the surface there, for a texel to the right and for one down [mm]."""
    first, second = np.moveaxis(sides.steps[nearest.side], 1, 0)
    return _between(first, second, nearest.share[:, None, None])


def _between(a: Doubles, b: Doubles, t: Doubles) -> Doubles:
    return np.asarray(a + (b - a) * t)
