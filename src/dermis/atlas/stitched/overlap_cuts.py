"""Cuts of pieces where the gutters of two parts of a border would overlap."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.stitched.cover import Cover, cover, metric_of, roots_of, runs_of
from dermis.atlas.stitched.gutter import GutterWidth, Packing, find_border
from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index
from dermis.atlas.unwrap.charts import pieces as connected

_FINEST_MM = 0.5  # texels of the grids on which overlaps are looked for
_MOST_TEXELS = 300_000  # of a piece on such a grid
_MOST_CELLS = 2_000_000  # of the grid
_NEAR = 0.6  # of the reach: conflicts farther out hardly matter
_LEAST = 1.0  # length of conflicts, in reaches, that is worth a cut
_WORTH = 0.2  # fewest conflicts that a cut separates per texel of its length
_ANGLES, _OFFSETS = 8, 16
_FRESH = 1.0  # of the conflicts' number: added to lengths, so that short cuts do not win by too much
_CRUMB = 0.1  # area in squares of the reach
_DEEPEST = 4
_GROWTH = 0.25  # of all pieces by gutters along cuts, at most


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


def cut_overlaps(surface: FlatSurface, piece: Index, reach_mm: float) -> Index:
    """Pieces (f,) cut along lines until gutters hardly overlap.

    reach_mm : width of the gutters
    """
    done, count = np.full(len(piece), -1, np.int64), 0
    order = np.argsort(piece, kind="stable")[np.count_nonzero(piece < 0) :]
    starts = np.flatnonzero(np.diff(piece[order])) + 1
    waiting = [(own, 0) for own in np.split(order, starts) if len(own)]
    room_mm2 = _GROWTH * surface.area_mm2[order].sum()
    while waiting:
        own, depth = waiting.pop()
        parts = _cut(surface, piece >= 0, own, reach_mm) if depth < _DEEPEST else None
        cost_mm2 = 0.0 if parts is None else 2 * reach_mm * _cut_mm(surface, own, parts)
        if parts is None or cost_mm2 > room_mm2:
            done[own] = count
            count += 1
        else:
            room_mm2 -= cost_mm2
            waiting += [(own[parts == k], depth + 1) for k in range(int(parts.max()) + 1)]
    return done


def _cut_mm(surface: FlatSurface, own: Index, part: Index) -> float:
    """Length of all sides between parts of the triangles `own`."""
    of = np.full(len(surface.uv), -1, np.int64)
    of[own] = part
    other = of[surface.beside_uv[own]]
    length = np.linalg.norm(np.roll(surface.corners[own], -1, axis=1) - surface.corners[own], axis=2)
    return float(length[(other >= 0) & (other != part[:, None])].sum()) / 2


def _cut(surface: FlatSurface, placed: Flags, own: Index, reach_mm: float) -> Index | None:
    """Part of each triangle of one piece, None when it needs no cut."""
    found = find_conflicts(surface, placed, own, reach_mm)
    reach = reach_mm / found.texel_mm
    part = np.zeros(len(own), np.int64)
    for number, cluster in enumerate(_clusters(found, reach), start=1):
        if len(cluster) * found.texel_mm < _LEAST * reach_mm:
            continue
        overlap = found._replace(one=found.one[cluster], other=found.other[cluster])
        normal, offset, parted = _best_line(overlap, reach)
        half = surface.uv[own].mean(axis=1) * found.per_uv @ normal > offset
        across = float(np.count_nonzero(np.abs(found.inside @ normal - offset) < 0.5))
        around = float(parted + 2 * reach)
        if parted < _WORTH * min(across, around):
            continue
        if across <= around:
            return _parts(surface, own, half.astype(np.int64), reach_mm)
        part[_strip(surface, own, overlap, half, reach) & (part == 0)] = number
    return _parts(surface, own, part, reach_mm)


def _clusters(found: Conflicts, reach: float) -> list[Index]:
    """Clusters of conflicts near each other, as their indices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    middle = (found.one + found.other) / 2
    if not len(middle):
        return []
    a, b = KDTree(middle).query_pairs(reach, output_type="ndarray").T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(middle),) * 2)
    count, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == k) for k in range(count)]


def _strip(surface: FlatSurface, own: Index, overlap: Conflicts, half: Flags, reach: float) -> Flags:
    """Triangles along that side of an overlap where they have less area."""
    from scipy.spatial import KDTree

    corners = surface.uv[own] * overlap.per_uv
    places = np.concatenate((corners, corners.mean(axis=1, keepdims=True)), axis=1)
    tree = KDTree(np.concatenate((overlap.one, overlap.other)))
    about = np.logical_and(places >= tree.mins - reach, places <= tree.maxes + reach)
    near = np.asarray(np.any(np.all(about, axis=2), axis=1))  # the others need no search
    near[near] = np.isfinite(tree.query(places[near], distance_upper_bound=reach)[0]).any(axis=1)
    area = surface.area_mm2[own]
    return near & (half if area[near & half].sum() < area[near & ~half].sum() else ~half)


def find_conflicts(surface: FlatSurface, placed: Flags, own: Index, reach_mm: float) -> Conflicts:
    """Conflicts of the piece that consists of the triangles `own`, on a grid of its own.

    placed : (f,) triangles of any piece
    """
    piece = np.where(placed, 1, -1)
    piece[own] = 0
    mm2, area_uv = surface.area_mm2[own].sum(), np.abs(surface.area_uv[own]).sum()
    low, high = surface.uv[own].min(axis=(0, 1)), surface.uv[own].max(axis=(0, 1))
    box_mm2 = float((high - low).prod()) * mm2 / area_uv
    texel_mm = max(_FINEST_MM, np.sqrt(mm2 / _MOST_TEXELS), np.sqrt(box_mm2 / _MOST_CELLS))
    per_uv = float(np.sqrt(mm2 / area_uv) / texel_mm)
    widest = np.ceil(2 * reach_mm / texel_mm)
    places = np.zeros(surface.uv.shape)
    places[own] = (surface.uv[own] - low) * per_uv + widest + 2
    every = np.ones(len(piece))
    packing = Packing(places, per_uv * every, every / texel_mm)
    width, height = np.ceil((high - low) * per_uv + 2 * widest + 5).astype(int)
    border = find_border(surface, piece, own)
    made = cover(
        surface, piece, own, border, packing, GutterWidth(reach_mm, widest), (int(height), int(width))
    )
    origin = low * per_uv - widest - 2
    one, other = _meetings(surface, packing, made, _NEAR * reach_mm)
    y, x = np.nonzero((made.rooted >= 0) & (made.away_mm == 0))
    return Conflicts(one + origin, other + origin, np.column_stack((x, y)) + origin, per_uv, float(texel_mm))


def _meetings(surface: FlatSurface, packing: Packing, made: Cover, near_mm: float) -> tuple[Doubles, Doubles]:
    """Roots (n, 2) of the texels on both sides of gaps [texel]."""
    near = np.where(made.away_mm < near_mm, made.piece, -1)
    roots = roots_of(packing, made)
    reach = runs_of(surface, made, near, metric_of(surface, packing, made), roots)
    left = (near[:, 1:] >= 0) & (near[:, :-1] >= 0) & (reach[:, 1:, 0] == 0)
    up = (near[1:] >= 0) & (near[:-1] >= 0) & (reach[1:, :, 2] == 0)
    one = np.concatenate((roots[:, 1:][left], roots[1:][up])).astype(np.float64)
    return one, np.concatenate((roots[:, :-1][left], roots[:-1][up])).astype(np.float64)


def _best_line(overlap: Conflicts, reach: float) -> tuple[Doubles, float, int]:
    """Normal and offset of the line that separates most conflicts for its length near them; their number."""
    from scipy.spatial import KDTree

    tree = KDTree(np.concatenate((overlap.one, overlap.other)))
    close = overlap.inside[np.isfinite(tree.query(overlap.inside, distance_upper_bound=reach)[0])]
    best, line = -1.0, (np.array([1.0, 0.0]), 0.0, 0)
    for angle in np.arange(_ANGLES) * np.pi / _ANGLES:
        normal = np.array([np.cos(angle), np.sin(angle)])
        one, other, inside = (places @ normal for places in (overlap.one, overlap.other, close))
        low, high = np.minimum(one, other), np.maximum(one, other)
        first, last = low.min(), high.max()
        for offset in first + (last - first) * (np.arange(_OFFSETS) + 0.5) / _OFFSETS:
            parted = np.count_nonzero((low < offset) & (offset < high))
            length = np.count_nonzero(np.abs(inside - offset) < 0.5)
            score = parted / (length + _FRESH * len(one))
            if score > best:
                best, line = score, (normal, float(offset), int(parted))
    return line


def _parts(surface: FlatSurface, own: Index, part: Index, reach_mm: float) -> Index | None:
    """Connected parts; crumbs along the cut join the largest part beside them. None for a single part."""
    index = np.full(len(surface.uv), -1, np.int64)
    index[own] = np.arange(len(own))
    there = index[surface.beside_uv[own]]
    beside = np.where(there >= 0, there, np.arange(len(own))[:, None])
    part = connected(part, beside)
    area = np.bincount(part, surface.area_mm2[own])
    crumbs = area[part] < _CRUMB * reach_mm**2
    host = np.take_along_axis(part[beside], area[part[beside]].argmax(axis=1)[:, None], axis=1)[:, 0]
    part = connected(np.where(crumbs, host, part), beside)
    return part if part.max() > 0 else None
