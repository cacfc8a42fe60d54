"""The surface that each texel of pieces and gutters shows, with its stretch and unbroken runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.gutter import Border, GutterTexels, GutterWidth, Packing, walk_gutter
from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index

Singles = NDArray[np.float32]
_STEPS, _SLACK_MM = 2.0, 0.5  # neighbours farther apart than so many steps plus the slack have a gap


@dataclass(frozen=True)
class Cover:
    """Texels of a grid and the surface they show.

    triangle, weights : (h, w), (h, w, 2) -1 where nothing is; weights of the second and third corner
    rooted, roots : the same at the nearest place on the texel's own piece: itself, or on the border
    piece : (h, w) piece, -1 where nothing is
    gutter : (h, w) texels that show what others compute
    away_mm : (h, w) distance from the piece
    """

    triangle: NDArray[np.int32]
    weights: NDArray[np.float32]
    rooted: NDArray[np.int32]
    roots: NDArray[np.float32]
    piece: NDArray[np.int32]
    gutter: Flags
    away_mm: NDArray[np.float32]


def cover(
    surface: FlatSurface,
    piece: Index,
    own: Index,
    border: Border,
    packing: Packing,
    width: GutterWidth,
    shape: tuple[int, int],
) -> Cover:
    """The texels of pieces that are placed apart from each other.

    piece, own : (f,) and numbers of triangles, as for `find_border`
    """
    from dermis.atlas.stitched.kernels.fill import fill, weigh

    # triangles that are mirrored within their piece are drawn first, so that others win
    drawn = own[np.argsort(~_mirrored(surface, piece[own], own), kind="stable")]
    owner, weights = np.full(shape, -1, np.int32), np.zeros((*shape, 2), np.float32)
    fill(packing.places, drawn, owner)
    weigh(packing.places, owner, weights)
    made = Cover(
        owner,
        weights,
        rooted=owner.copy(),
        roots=weights.copy(),
        piece=np.empty(shape, np.int32),
        gutter=np.zeros(shape, np.bool_),
        away_mm=np.zeros(shape, np.float32),
    )
    _add_gutters(made, piece, walk_gutter(surface, border, packing, width, owner))
    made.piece[:] = np.where(made.rooted >= 0, piece[np.maximum(made.rooted, 0)], -1)
    return made


def _add_gutters(made: Cover, piece: Index, found: GutterTexels) -> None:
    """Write rims and gutters into a cover of pieces alone."""
    y, x = found.y, found.x
    made.rooted[y, x], made.roots[y, x], made.away_mm[y, x] = found.root, found.root_weights, found.away_mm
    made.triangle[y, x], made.weights[y, x] = found.triangle, found.weights
    made.gutter[y, x] = ~found.rim
    ended = np.zeros(made.gutter.shape, np.bool_)
    ended[y, x] = ~found.whole
    astray = ~found.whole & ~found.rim
    made.triangle[y[astray], x[astray]] = -1
    _repeat_edge(made, piece, ended, y[astray], x[astray])
    # gutters end where the atlas does not hold their light
    gone = made.gutter & ((made.triangle < 0) | (piece[np.maximum(made.triangle, 0)] < 0))
    for grid in (made.triangle, made.rooted):
        grid[gone] = -1
    made.gutter[gone] = False


def _mirrored(surface: FlatSurface, piece: Index, own: Index) -> Flags:
    """Which of the triangles `own` face the other way than most of their piece."""
    whole = np.bincount(piece, surface.area_uv[own])
    return np.asarray(np.sign(whole)[piece] != np.sign(surface.area_uv[own]))


def _repeat_edge(made: Cover, piece: Index, ended: Flags, y: Index, x: Index) -> None:
    """Gutter texels just beyond the end of the surface repeat their neighbours.

    A blur along the edge then reads the same from a gutter as from the rim of a piece.

    ended : (h, w) texels that the surface does not reach
    y, x : (n,) such texels in gutters
    """
    last = np.array(ended.shape) - 1
    from_y, from_x = y.copy(), x.copy()
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        beside_y, beside_x = np.clip(y + dy, 0, last[0]), np.clip(x + dx, 0, last[1])
        root = made.rooted[beside_y, beside_x]
        same = (root >= 0) & ~ended[beside_y, beside_x] & (piece[root] == piece[made.rooted[y, x]])
        from_y, from_x = np.where(same, beside_y, from_y), np.where(same, beside_x, from_x)
    made.triangle[y, x], made.weights[y, x] = made.triangle[from_y, from_x], made.weights[from_y, from_x]


def metric_of(surface: FlatSurface, packing: Packing, made: Cover) -> Singles:
    """(h, w, 3) texels per mm along u and v and the cosine between them; in gutters those at the border."""
    metric = _read(made.rooted, made.roots, surface.lengths)
    covered = made.rooted >= 0
    per_uv = packing.per_uv[made.rooted[covered]].astype(np.float32)
    metric[covered, :2] = per_uv[:, None] / np.maximum(metric[covered, :2], 1e-3)
    return metric


def roots_of(packing: Packing, made: Cover) -> Singles:
    """(h, w, 2) nearest place on its own piece [texel] of each texel."""
    return _read(made.rooted, made.roots, packing.places)


def runs_of(
    surface: FlatSurface, made: Cover, chart: NDArray[np.int32], metric: Singles, roots: Singles
) -> NDArray[np.uint16]:
    """(h, w, 4) texels to the left, right, up and down of the same chart, while the surface continues.

    chart : (h, w) -1 where nothing is
    metric, roots : of `metric_of` and `roots_of`
    """
    from dermis.atlas.stitched.kernels.texels import runs

    points = _read(made.triangle, made.weights, surface.corners)
    reach = np.zeros((*chart.shape, 4), np.uint16)
    runs(chart, points, roots, metric, _STEPS, _SLACK_MM, reach)
    return reach


def _read(triangle: NDArray[np.int32], weights: Singles, corners: Doubles) -> Singles:
    """(h, w, c) of (f, 3, c) at corners, 0 where there is no triangle."""
    from dermis.atlas.stitched.kernels.texels import read

    values = np.zeros((*triangle.shape, corners.shape[2]), np.float32)
    read(triangle, weights, corners, values)
    return values
