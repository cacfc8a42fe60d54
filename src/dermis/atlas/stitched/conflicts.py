"""Where the gutters of two parts of a piece's border would overlap."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.gutter import (
    Border,
    GutterWidth,
    Packing,
    find_border,
    places_on,
    sides_of,
    steps_at,
    walk_from,
)
from dermis.atlas.stitched.nearest import Nearest, Sides, nearest_sides
from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index
from dermis.atlas.stitched.texels import Rooted, gap_mm, opposed, owners, unsure, weights_in

_FINEST_MM = 0.9  # texels of the grids on which overlaps are looked for
_MOST_TEXELS = 100_000  # of a piece on such a grid
_MOST_CELLS = 600_000  # of the grid
_NEAR = 0.6  # of the reach: conflicts farther out hardly matter


class Conflicts(NamedTuple):
    """Texels at which a piece's gutters overlap.

    one, other : (n, 2) the two places of the piece that these gutters belong to [texel]
    inside : (m, 2) texels of the piece
    per_uv : texels in a unit of uv
    texel_mm : their side on the surface
    """

    one: Doubles
    other: Doubles
    inside: Doubles
    per_uv: float
    texel_mm: float

    @property
    def length_mm(self) -> float:
        """Length along which the gutters overlap."""
        return len(self.one) * self.texel_mm


class _Grid(NamedTuple):
    """A piece and its gutters.

    owner : (h, w) triangles of the piece, -1 in gutters, -2 where nothing is
    number : (h, w) place of each texel in `rooted`, those of the piece first
    packing, border, sides : of the piece
    nearest : texels of the gutters
    """

    owner: NDArray[np.int32]
    number: Index
    rooted: Rooted
    packing: Packing
    border: Border
    sides: Sides
    nearest: Nearest


def find_conflicts(surface: FlatSurface, placed: Flags, own: Index, reach_mm: float) -> Conflicts:
    """Conflicts of the piece that consists of the triangles `own`, on a grid of its own.

    placed : (f,) triangles of any piece
    """
    mm2, area_uv = surface.area_mm2[own].sum(), np.abs(surface.area_uv[own]).sum()
    low, high = surface.uv[own].min(axis=(0, 1)), surface.uv[own].max(axis=(0, 1))
    box_mm2 = float((high - low).prod()) * mm2 / area_uv
    texel_mm = float(max(_FINEST_MM, np.sqrt(mm2 / _MOST_TEXELS), np.sqrt(box_mm2 / _MOST_CELLS)))
    per_uv = float(np.sqrt(mm2 / area_uv) / texel_mm)
    width = GutterWidth(reach_mm, np.ceil(2 * reach_mm / texel_mm))
    margin, every = width.widest + 2, np.ones(len(placed))
    places = np.zeros(surface.uv.shape)
    places[own] = (surface.uv[own] - low) * per_uv + margin
    across, down = np.ceil((high - low) * per_uv + 2 * margin + 1).astype(int)
    piece = np.where(placed, 1, -1)
    piece[own] = 0
    packing, shape = Packing(places, per_uv * every, every / texel_mm), (int(down), int(across))
    grid = _grid(surface, find_border(surface, piece, own), packing, width, owners(places, own, shape))
    one, other = (grid.rooted.those(found) for found in _meetings(surface, placed, grid))
    origin = low * per_uv - margin
    inside = grid.rooted.texels[: np.count_nonzero(grid.owner >= 0)] + origin
    return Conflicts(one.roots + origin, other.roots + origin, inside, per_uv, texel_mm)


def _grid(
    surface: FlatSurface, border: Border, packing: Packing, width: GutterWidth, owner: NDArray[np.int32]
) -> _Grid:
    sides = sides_of(surface, border, packing, width)
    sides = sides._replace(reach_mm=_NEAR * sides.reach_mm)
    nearest, own = nearest_sides(sides, owner >= 0), np.flatnonzero(owner >= 0)
    f, texel = owner.ravel()[own], np.concatenate((own, nearest.texel))
    number, labels = np.full(owner.shape, -1), np.where(owner >= 0, owner, -2)
    number.ravel()[texel] = np.arange(len(texel))
    labels.ravel()[nearest.texel] = -1
    texels = np.column_stack(np.divmod(texel, owner.shape[1])[::-1]).astype(np.float64)
    roots = np.concatenate((texels[: len(own)], places_on(sides, nearest)))
    steps = surface.lengths[f, 0, :2] / packing.per_uv[f, None]
    step_mm = np.concatenate((steps, np.linalg.norm(steps_at(sides, nearest), axis=2)))
    return _Grid(labels, number, Rooted(texels, roots, step_mm), packing, border, sides, nearest)


def _meetings(surface: FlatSurface, placed: Flags, grid: _Grid) -> tuple[Index, Index]:
    """Pairs (n,), (n,) of texels beside each other between which there is a gap."""
    found = []
    for axis in (0, 1):
        a, b = (grid.number.ravel()[texel] for texel in unsure(surface, grid.owner, axis))
        far = opposed(grid.rooted.those(a), grid.rooted.those(b))
        a, b = a[far], b[far]
        found.append((a, b, gap_mm(grid.rooted.those(a), grid.rooted.those(b), axis)))
    one, other, limit = (np.concatenate(part) for part in zip(*found, strict=True))
    points = _points(surface, placed, grid, np.concatenate((one, other)))
    # places that do not exist are NaN, and not far from anything
    gap = np.linalg.norm(points[one] - points[other], axis=1) > limit
    return one[gap], other[gap]


def _points(surface: FlatSurface, placed: Flags, grid: _Grid, chosen: Index) -> Doubles:
    """(n, 3) points that the chosen texels show [mm]; NaN for others and where the surface has ended."""
    owner, texels = grid.owner[grid.owner >= 0], grid.rooted.texels
    points, wanted = np.full((len(texels), 3), np.nan), np.zeros(len(texels), np.bool_)
    wanted[chosen] = True
    own, beyond = np.flatnonzero(wanted[: len(owner)]), np.flatnonzero(wanted[len(owner) :])
    f = owner[own]
    points[own] = surface.at(f, weights_in(grid.packing.places[f], texels[own]))
    nearest = Nearest._make(part[beyond] for part in grid.nearest)
    ends, _ = walk_from(surface, grid.border, grid.sides, nearest, texels[len(owner) + beyond])
    there = nearest.rim | (ends.whole & placed[ends.triangle])
    points[len(owner) + beyond[there]] = surface.at(ends.triangle, ends.weights)[there]
    return points
