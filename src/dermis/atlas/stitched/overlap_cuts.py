"""Cuts where the gutters of a chart would overlap themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.gutter import (
    Border,
    GutterWidth,
    Packing,
    border_points,
    border_sides,
    border_steps,
    find_border,
    trace_from_border,
)
from dermis.atlas.stitched.nearest import BorderSides, NearestPoints, nearest_border_points
from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index
from dermis.atlas.stitched.texels import (
    AnchoredTexels,
    anchors_diverge,
    barycentric_weights,
    gap_mm,
    rasterise_owners,
    unconnected_pairs,
)
from dermis.atlas.unwrap.charts import connected_pieces
from dermis.mesh.geometry import components

_FINEST_MM = 0.9  # texels of the grids on which overlaps are looked for
_MOST_TEXELS = 100_000  # of a piece on such a grid
_MOST_CELLS = 600_000  # of the grid
_NEAR = 0.6  # of the reach: conflicts farther out hardly matter
_CELL, _FINE = 0.7, 8  # of the reach, conflicts in cells beside each other are near; cells in a reach
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
    texels_per_uv: float
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
    rooted: AnchoredTexels
    packing: Packing
    border: Border
    sides: BorderSides
    nearest: NearestPoints


def find_conflicts(surface: FlatSurface, placed: Flags, own: Index, gutter_mm: float) -> Conflicts:
    """Conflicts of the piece that consists of the triangles `own`, on a grid of its own.

    placed : (f,) triangles of any piece
    """
    mm2, area_uv = surface.area_mm2[own].sum(), np.abs(surface.area_uv[own]).sum()
    low, high = surface.uv[own].min(axis=(0, 1)), surface.uv[own].max(axis=(0, 1))
    box_mm2 = float((high - low).prod()) * mm2 / area_uv
    texel_mm = float(max(_FINEST_MM, np.sqrt(mm2 / _MOST_TEXELS), np.sqrt(box_mm2 / _MOST_CELLS)))
    texels_per_uv = float(np.sqrt(mm2 / area_uv) / texel_mm)
    width = GutterWidth(gutter_mm, np.ceil(2 * gutter_mm / texel_mm))
    margin, every = width.max_texels + 2, np.ones(len(placed))
    places = np.zeros(surface.uv.shape)
    places[own] = (surface.uv[own] - low) * texels_per_uv + margin
    across, down = np.ceil((high - low) * texels_per_uv + 2 * margin + 1).astype(int)
    piece = np.where(placed, 1, -1)
    piece[own] = 0
    packing, shape = Packing(places, texels_per_uv * every, every / texel_mm), (int(down), int(across))
    grid = _grid(surface, find_border(surface, piece, own), packing, width, rasterise_owners(places, own, shape))
    one, other = (grid.rooted.select(found) for found in _meetings(surface, placed, grid))
    origin = low * texels_per_uv - margin
    inside = grid.rooted.texels[: np.count_nonzero(grid.owner >= 0)] + origin
    return Conflicts(one.roots + origin, other.roots + origin, inside, texels_per_uv, texel_mm)


def _grid(
    surface: FlatSurface, border: Border, packing: Packing, width: GutterWidth, owner: NDArray[np.int32]
) -> _Grid:
    sides = border_sides(surface, border, packing, width)
    sides = sides._replace(gutter_mm=_NEAR * sides.gutter_mm)
    nearest, own = nearest_border_points(sides, owner >= 0), np.flatnonzero(owner >= 0)
    f, texel = owner.ravel()[own], np.concatenate((own, nearest.texel))
    number, labels = np.full(owner.shape, -1), np.where(owner >= 0, owner, -2)
    number.ravel()[texel] = np.arange(len(texel))
    labels.ravel()[nearest.texel] = -1
    texels = np.column_stack(np.divmod(texel, owner.shape[1])[::-1]).astype(np.float64)
    roots = np.concatenate((texels[: len(own)], border_points(sides, nearest)))
    steps = surface.uv_metric[f, 0, :2] / packing.texels_per_uv[f, None]
    step_mm = np.concatenate((steps, np.linalg.norm(border_steps(sides, nearest), axis=2)))
    return _Grid(labels, number, AnchoredTexels(texels, roots, step_mm), packing, border, sides, nearest)


def _meetings(surface: FlatSurface, placed: Flags, grid: _Grid) -> tuple[Index, Index]:
    """Pairs (n,), (n,) of texels beside each other between which there is a gap."""
    found = []
    for axis in (0, 1):
        a, b = (grid.number.ravel()[texel] for texel in unconnected_pairs(surface, grid.owner, axis))
        far = anchors_diverge(grid.rooted.select(a), grid.rooted.select(b))
        a, b = a[far], b[far]
        found.append((a, b, gap_mm(grid.rooted.select(a), grid.rooted.select(b), axis)))
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
    points[own] = surface.points(f, barycentric_weights(grid.packing.corners[f], texels[own]))
    nearest = NearestPoints._make(part[beyond] for part in grid.nearest)
    ends, _ = trace_from_border(surface, grid.border, grid.sides, nearest, texels[len(owner) + beyond])
    there = nearest.rim | (ends.complete & placed[ends.triangle])
    points[len(owner) + beyond[there]] = surface.points(ends.triangle, ends.weights)[there]
    return points


def cut_overlaps(surface: FlatSurface, piece: Index, gutter_mm: float) -> Index:
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
        parts = _cut(surface, piece >= 0, own, gutter_mm) if depth < _DEEPEST else None
        cost_mm2 = 0.0 if parts is None else 2 * gutter_mm * _cut_mm(surface, own, parts)
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
    other = of[surface.uv_neighbour[own]]
    length = np.linalg.norm(np.roll(surface.corners[own], -1, axis=1) - surface.corners[own], axis=2)
    return float(length[(other >= 0) & (other != part[:, None])].sum()) / 2


def _cut(surface: FlatSurface, placed: Flags, own: Index, gutter_mm: float) -> Index | None:
    """Part of each triangle of one piece, None when it needs no cut."""
    found = find_conflicts(surface, placed, own, gutter_mm)
    reach = gutter_mm / found.texel_mm
    part = np.zeros(len(own), np.int64)
    for number, cluster in enumerate(_clusters(found, reach), start=1):
        if len(cluster) * found.texel_mm < _LEAST * gutter_mm:
            continue
        overlap = found._replace(one=found.one[cluster], other=found.other[cluster])
        normal, offset, parted = _best_line(overlap, reach)
        half = surface.uv[own].mean(axis=1) * found.texels_per_uv @ normal > offset
        across = float(np.count_nonzero(np.abs(found.inside @ normal - offset) < 0.5))
        around = float(parted + 2 * reach)
        if parted < _WORTH * min(across, around):
            continue
        if across <= around:
            return _parts(surface, own, half.astype(np.int64), gutter_mm)
        part[_strip(surface, own, overlap, half, reach) & (part == 0)] = number
    return _parts(surface, own, part, gutter_mm)


def _clusters(found: Conflicts, reach: float) -> list[Index]:
    """Clusters of conflicts near each other, as their indices."""
    cells = np.floor((found.one + found.other) / 2 / (_CELL * reach)).astype(np.int64)
    cells, of = np.unique(cells, axis=0, return_inverse=True)
    neighbour = np.abs(cells[:, None] - cells).max(axis=2) <= 1
    label = components(len(cells), *np.nonzero(neighbour))[of.reshape(-1)]
    return [np.flatnonzero(label == k) for k in range(label.max(initial=-1) + 1)]


def _near(places: Doubles, others: Doubles, reach: float) -> Flags:
    """Which of the places (..., 2) are about within reach of any of the others (n, 2)."""
    cell = reach / _FINE
    low = np.floor(others.min(axis=0) / cell) - _FINE - 1
    disc = np.argwhere(np.hypot(*(np.indices((2 * _FINE + 1,) * 2) - _FINE)) <= _FINE)
    at = np.floor(others / cell - low).astype(np.int64) - _FINE
    found = np.zeros(at.max(axis=0) + 2 * _FINE + 2, np.bool_)
    found[tuple(np.moveaxis(at[:, None] + disc, 2, 0))] = True
    where = np.floor(places / cell - low).astype(np.int64)
    where = np.where(((where >= 0) & (where < found.shape)).all(axis=-1, keepdims=True), where, 0)
    return np.asarray(found[where[..., 0], where[..., 1]])  # at 0 there is nothing


def _strip(surface: FlatSurface, own: Index, overlap: Conflicts, half: Flags, reach: float) -> Flags:
    """Triangles along that side of an overlap where they have less area."""
    corners = surface.uv[own] * overlap.texels_per_uv
    places = np.concatenate((corners, corners.mean(axis=1, keepdims=True)), axis=1)
    near = np.asarray(_near(places, np.concatenate((overlap.one, overlap.other)), reach).any(axis=1))
    area = surface.area_mm2[own]
    return near & (half if area[near & half].sum() < area[near & ~half].sum() else ~half)


def _best_line(overlap: Conflicts, reach: float) -> tuple[Doubles, float, int]:
    """Normal and offset of the line that separates most conflicts for its length near them; their number."""
    close = overlap.inside[_near(overlap.inside, np.concatenate((overlap.one, overlap.other)), reach)]
    best, line = -1.0, (np.array([1.0, 0.0]), 0.0, 0)
    for angle in np.arange(_ANGLES) * np.pi / _ANGLES:
        normal = np.array([np.cos(angle), np.sin(angle)])
        one, other, inside = (places @ normal for places in (overlap.one, overlap.other, close))
        low, high = np.minimum(one, other), np.maximum(one, other)
        first, last = low.min(), high.max()
        offsets = first + (last - first) * (np.arange(_OFFSETS)[:, None] + 0.5) / _OFFSETS
        parted = np.count_nonzero((low < offsets) & (offsets < high), axis=1)
        length = np.count_nonzero(np.abs(inside - offsets) < 0.5, axis=1)
        score = parted / (length + _FRESH * len(one))
        found = int(score.argmax())
        if score[found] > best:
            best, line = score[found], (normal, float(offsets[found, 0]), int(parted[found]))
    return line


def _parts(surface: FlatSurface, own: Index, part: Index, gutter_mm: float) -> Index | None:
    """Connected parts; crumbs along the cut join the largest part beside them. None for a single part."""
    index = np.full(len(surface.uv), -1, np.int64)
    index[own] = np.arange(len(own))
    there = index[surface.uv_neighbour[own]]
    neighbour = np.where(there >= 0, there, np.arange(len(own))[:, None])
    part = connected_pieces(part, neighbour)
    area = np.bincount(part, surface.area_mm2[own])
    crumbs = area[part] < _CRUMB * gutter_mm**2
    host = np.take_along_axis(part[neighbour], area[part[neighbour]].argmax(axis=1)[:, None], axis=1)[:, 0]
    part = connected_pieces(np.where(crumbs, host, part), neighbour)
    return part if part.max() > 0 else None
