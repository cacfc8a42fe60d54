"""The surface that each texel of pieces and gutters shows, with its stretch and unbroken runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.gutter import Border, GutterTexels, GutterWidth, Packing, trace_gutter
from dermis.atlas.stitched.surface import Flags, FlatSurface, Index, interpolate_corners
from dermis.atlas.stitched.texels import (
    AnchoredTexels,
    anchors_diverge,
    centre_weights,
    gap_mm,
    run_lengths,
    mostly_hidden,
    rasterise_owners,
    unconnected_pairs,
)

Singles = NDArray[np.float32]


@dataclass(frozen=True)
class Coverage:
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
    distance_mm: NDArray[np.float32]


def compute_coverage(
    surface: FlatSurface,
    piece: Index,
    own: Index,
    border: Border,
    packing: Packing,
    width: GutterWidth,
    shape: tuple[int, int],
) -> Coverage:
    """The texels of pieces that are placed apart from each other.

    piece, own : (f,) and numbers of triangles, as for `find_border`
    """
    owner = rasterise_owners(packing.corners, _drawn(surface, piece, own), shape)
    weights = centre_weights(packing.corners, owner)
    made = Coverage(
        owner,
        weights,
        rooted=owner.copy(),
        roots=weights.copy(),
        piece=np.empty(shape, np.int32),
        gutter=np.zeros(shape, np.bool_),
        distance_mm=np.zeros(shape, np.float32),
    )
    _add_gutters(made, piece, trace_gutter(surface, border, packing, width, owner))
    made.piece[:] = np.where(made.rooted >= 0, piece[np.maximum(made.rooted, 0)], -1)
    return made


def _add_gutters(made: Coverage, piece: Index, found: GutterTexels) -> None:
    """Write rims and gutters into a cover of pieces alone."""
    y, x = found.y, found.x
    made.rooted[y, x], made.roots[y, x], made.distance_mm[y, x] = found.root, found.root_weights, found.distance_mm
    made.triangle[y, x], made.weights[y, x] = found.triangle, found.weights
    made.gutter[y, x] = ~found.rim
    ended = np.zeros(made.gutter.shape, np.bool_)
    ended[y, x] = ~found.complete
    astray = ~found.complete & ~found.rim
    made.triangle[y[astray], x[astray]] = -1
    _repeat_edge(made, piece, ended, y[astray], x[astray])
    # gutters end where the atlas does not hold their light
    gone = made.gutter & ((made.triangle < 0) | (piece[np.maximum(made.triangle, 0)] < 0))
    for grid in (made.triangle, made.rooted):
        grid[gone] = -1
    made.gutter[gone] = False


def hidden_triangles(surface: FlatSurface, piece: Index, packing: Packing, size: int) -> Flags:
    """Triangles (f,) most of whose texels others of their piece own."""
    own = np.flatnonzero(piece >= 0)
    owner = rasterise_owners(packing.corners, _drawn(surface, piece, own), (size, size))
    return mostly_hidden(packing.corners, own, owner)


def _drawn(surface: FlatSurface, piece: Index, own: Index) -> Index:
    """Triangles that are mirrored within their piece first, so that others win."""
    return own[np.argsort(~_mirrored(surface, piece[own], own), kind="stable")]


def _mirrored(surface: FlatSurface, piece: Index, own: Index) -> Flags:
    """Which of the triangles `own` face the other way than most of their piece."""
    complete = np.bincount(piece, surface.area_uv[own])
    return np.asarray(np.sign(complete)[piece] != np.sign(surface.area_uv[own]))


def _repeat_edge(made: Coverage, piece: Index, ended: Flags, y: Index, x: Index) -> None:
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


def texel_metric(surface: FlatSurface, packing: Packing, made: Coverage) -> Singles:
    """(h, w, 3) texels per mm along u and v and the cosine between them; in gutters those at the border."""
    metric, there = np.zeros((*made.rooted.shape, 3), np.float32), made.rooted >= 0
    found = interpolate_corners(surface.uv_metric.astype(np.float32), made.rooted[there], made.roots[there])
    texels_per_uv = packing.texels_per_uv[made.rooted[there]].astype(np.float32)
    found[:, :2] = texels_per_uv[:, None] / np.maximum(found[:, :2], 1e-3)
    metric[there] = found
    return metric


def edge_distances(surface: FlatSurface, packing: Packing, made: Coverage) -> NDArray[np.uint16]:
    """(h, w, 4) texels to the left, right, up and down of the same piece, while the surface continues.

    It ends between texels whose points are farther apart than `gap_mm`, and whose roots are farther apart
    than either texel is from its root.
    """
    owner = np.where(made.rooted >= 0, np.where(made.distance_mm > 0, -1, made.rooted), -2)
    reach = np.empty((*owner.shape, 4), np.uint16)
    for axis in (0, 1):
        joined = np.zeros(owner.shape, np.bool_)
        here, before = np.moveaxis(joined, 1 - axis, 0)[1:], np.moveaxis(made.piece, 1 - axis, 0)
        here[:] = (before[1:] >= 0) & (before[1:] == before[:-1])
        first, second = unconnected_pairs(surface, owner, axis)
        same = joined.ravel()[second]
        joined.ravel()[second[same]] = ~_parted(surface, packing, made, first[same], second[same], axis)
        found = run_lengths(np.moveaxis(joined, 1 - axis, 1))
        reach[..., 2 * axis], reach[..., 2 * axis + 1] = (np.moveaxis(one, 1, 1 - axis) for one in found)
    return reach


def _parted(
    surface: FlatSurface, packing: Packing, made: Coverage, first: Index, second: Index, axis: int
) -> Flags:
    """Whether there is a gap between texels, by their flat indices."""
    one, other = (_rooted(surface, packing, made, texel) for texel in (first, second))
    triangle, weights = made.triangle.ravel(), made.weights.reshape(-1, 2)
    points = [surface.points(triangle[texel], weights[texel]) for texel in (first, second)]
    apart_mm = np.linalg.norm(points[0] - points[1], axis=1)
    return np.asarray(anchors_diverge(one, other) & (apart_mm > gap_mm(one, other, axis)))


def _rooted(surface: FlatSurface, packing: Packing, made: Coverage, texel: Index) -> AnchoredTexels:
    root, weights = made.rooted.ravel()[texel], made.roots.reshape(-1, 2)[texel]
    texels = np.column_stack(np.divmod(texel, made.rooted.shape[1])[::-1]).astype(np.float64)
    steps = surface.uv_metric[root, 0, :2] / packing.texels_per_uv[root, None]
    return AnchoredTexels(texels, interpolate_corners(packing.corners, root, weights), steps)
