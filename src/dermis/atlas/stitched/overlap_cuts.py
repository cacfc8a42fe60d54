"""Cuts that divide a chart if parts of its gutter would otherwise overlap each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.raster import barycentric_weights
from dermis.atlas.stitched.gutter import (
    Border,
    GutterWidth,
    Packing,
    border_points,
    border_sides,
    border_texel_steps,
    find_border,
    trace_from_border,
)
from dermis.atlas.stitched.nearest import BorderSides, NearestPoints, nearest_border_points
from dermis.atlas.stitched.surface import FlatSurface
from dermis.atlas.stitched.texels import (
    AnchoredTexels,
    anchors_diverge,
    gap_limit_mm,
    rasterise_texel_triangles,
    unconnected_pairs,
)
from dermis.atlas.unwrap.charts import connected_pieces
from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.mesh.geometry import label_components

_MIN_TEXEL_MM = 0.9  # smallest texel of the grids on which overlaps are searched
_MAX_PIECE_TEXELS = 100_000  # largest number of texels of a piece on such a grid
_MAX_GRID_TEXELS = 600_000  # largest number of texels of the whole grid
_CONFLICT_RANGE_GUTTER_WIDTHS = 0.6  # fraction of the gutter width within which conflicts are counted
_CLUSTER_CELL_GUTTER_WIDTHS = (
    0.7  # size of cells for clusters, in gutter widths; adjacent cells form one cluster
)
_CELLS_PER_GUTTER = 8  # cells of the grid for distances, per gutter width
_MIN_CONFLICT_LENGTH_GUTTER_WIDTHS = 1.0  # shortest length of conflicts that is worth a cut, in gutter widths
_MIN_CONFLICTS_PER_CUT_TEXEL = 0.2  # fewest separated conflicts per texel of a cut
_LINE_DIRECTION_COUNT, _LINE_OFFSET_COUNT = 8, 16  # number of directions and offsets of lines that are tried
_CUT_LENGTH_BIAS_TEXELS = (
    1.0  # texels per conflict that are added to a cut's length, so that very short cuts are not preferred
)
_MIN_PART_AREA_GUTTER_WIDTHS2 = 0.1  # area of the smallest part that stays separate, in squared gutter widths
_MAX_SUCCESSIVE_CUTS = 4  # largest number of successive cuts
_MAX_RELATIVE_AREA_GROWTH = 0.25  # largest growth of the area of all pieces by gutters along cuts


class Conflicts(NamedTuple):
    """Conflicts in the gutters of a chart piece: pairs of border points whose gutters meet.

    Where they meet, the two gutters show points that are not adjacent on the surface.

    first, second : (n, 2) positions of the two border points of each pair, in uv scaled to texels [texel]
    inside : (m, 2) texels that the piece covers, in the same coordinates [texel]
    texels_per_uv : texels per unit of uv
    texel_mm : side of a texel on the surface [mm]
    """

    first: Doubles
    second: Doubles
    inside: Doubles
    texels_per_uv: float
    texel_mm: float

    @property
    def length_mm(self) -> float:
        """Return the length of the line along which gutters meet [mm]."""
        return len(self.first) * self.texel_mm


class _PieceGrid(NamedTuple):
    """Texel grid with one chart piece and its gutters.

    owner : (h, w) triangle to which each texel belongs, -1 in gutters, -2 elsewhere
    row : (h, w) index of each texel in `anchored`
    anchored : texels of the piece, followed by gutter texels, each with its anchor: the nearest point of the
        piece
    packing : position of the piece on the grid
    border : border of the piece
    sides : border sides on the grid
    nearest : nearest border points of the gutter texels
    """

    owner: Ints
    row: Index
    anchored: AnchoredTexels
    packing: Packing
    border: Border
    sides: BorderSides
    nearest: NearestPoints


def find_gutter_conflicts(
    surface: FlatSurface, mapped_triangles: Mask, member_triangles: Index, gutter_mm: float
) -> Conflicts:
    """Find where gutters of one chart piece meet, by drawing the piece on a separate texel grid.

    mapped_triangles : (f,) mask of triangles that belong to any piece
    member_triangles : (t,) indices of the triangles of this piece
    gutter_mm : width of the gutters [mm]
    """
    mm2, uv_area = surface.area_mm2[member_triangles].sum(), np.abs(surface.uv_area[member_triangles]).sum()
    low, high = surface.uv[member_triangles].min(axis=(0, 1)), surface.uv[member_triangles].max(axis=(0, 1))
    box_mm2 = float((high - low).prod()) * mm2 / uv_area
    texel_mm = float(
        max(_MIN_TEXEL_MM, np.sqrt(mm2 / _MAX_PIECE_TEXELS), np.sqrt(box_mm2 / _MAX_GRID_TEXELS))
    )
    texels_per_uv = float(np.sqrt(mm2 / uv_area) / texel_mm)
    width = GutterWidth(gutter_mm, np.ceil(2 * gutter_mm / texel_mm))
    margin, ones = width.max_texels + 2, np.ones(len(mapped_triangles))
    corners = np.zeros(surface.uv.shape)
    corners[member_triangles] = (surface.uv[member_triangles] - low) * texels_per_uv + margin
    columns, rows = np.ceil((high - low) * texels_per_uv + 2 * margin + 1).astype(int)
    piece = np.where(mapped_triangles, 1, -1)
    piece[member_triangles] = 0
    packing, shape = Packing(corners, texels_per_uv * ones, ones / texel_mm), (int(rows), int(columns))
    grid = _draw_piece_grid(
        surface,
        find_border(surface, piece, member_triangles),
        packing,
        width,
        rasterise_texel_triangles(corners, member_triangles, shape),
    )
    first, second = (grid.anchored.select(texels) for texels in _gap_pairs(surface, mapped_triangles, grid))
    origin = low * texels_per_uv - margin
    inside = grid.anchored.texels[: np.count_nonzero(grid.owner >= 0)] + origin
    return Conflicts(first.anchors + origin, second.anchors + origin, inside, texels_per_uv, texel_mm)


def _draw_piece_grid(
    surface: FlatSurface, border: Border, packing: Packing, gutter_width: GutterWidth, texel_triangle: Ints
) -> _PieceGrid:
    sides = border_sides(surface, border, packing, gutter_width)
    sides = sides._replace(gutter_mm=_CONFLICT_RANGE_GUTTER_WIDTHS * sides.gutter_mm)
    nearest, covered = nearest_border_points(sides, texel_triangle >= 0), np.flatnonzero(texel_triangle >= 0)
    f, texel = texel_triangle.ravel()[covered], np.concatenate((covered, nearest.texel))
    row, labels = np.full(texel_triangle.shape, -1), np.where(texel_triangle >= 0, texel_triangle, -2)
    row.ravel()[texel] = np.arange(len(texel))
    labels.ravel()[nearest.texel] = -1
    texels = np.column_stack(np.divmod(texel, texel_triangle.shape[1])[::-1]).astype(np.float64)
    anchors = np.concatenate((texels[: len(covered)], border_points(sides, nearest)))
    steps = surface.uv_metric[f, 0, :2] / packing.texels_per_uv[f, None]
    step_mm = np.concatenate((steps, np.linalg.norm(border_texel_steps(sides, nearest), axis=2)))
    return _PieceGrid(labels, row, AnchoredTexels(texels, anchors, step_mm), packing, border, sides, nearest)


def _gap_pairs(surface: FlatSurface, mapped_triangles: Mask, grid: _PieceGrid) -> tuple[Index, Index]:
    """Return pairs of adjacent texels whose surface points are not adjacent on the surface.

    The two arrays (n,) hold the first and the second texel of each pair, as indices into
    `_PieceGrid.anchored`.

    mapped_triangles : (f,) mask of triangles that belong to any piece
    grid : texel grid with the piece and its gutters
    """
    found = []
    for axis in (0, 1):
        a, b = (grid.row.ravel()[texel] for texel in unconnected_pairs(surface, grid.owner, axis))
        far = anchors_diverge(grid.anchored.select(a), grid.anchored.select(b))
        a, b = a[far], b[far]
        found.append((a, b, gap_limit_mm(grid.anchored.select(a), grid.anchored.select(b), axis)))
    first, second, limit = (np.concatenate(part) for part in zip(*found, strict=True))
    points = _texel_points(surface, mapped_triangles, grid, np.concatenate((first, second)))
    # points beyond the end of the surface are NaN, which compares as no gap
    gap = np.linalg.norm(points[first] - points[second], axis=1) > limit
    return first[gap], second[gap]


def _texel_points(
    surface: FlatSurface, mapped_triangles: Mask, grid: _PieceGrid, chosen_texels: Index
) -> Doubles:
    """Compute the surface points of chosen texels; return one row for each texel of the grid, (n, 3) [mm].

    The rows are in the order of `_PieceGrid.anchored`. Rows of other texels are NaN, and so are those of
    chosen texels that lie beyond the end of the surface.

    mapped_triangles : (f,) mask of triangles that belong to any piece
    chosen_texels : row indices of the chosen texels
    """
    owner, texels = grid.owner[grid.owner >= 0], grid.anchored.texels
    points, is_chosen = np.full((len(texels), 3), np.nan), np.zeros(len(texels), np.bool_)
    is_chosen[chosen_texels] = True
    members, beyond = np.flatnonzero(is_chosen[: len(owner)]), np.flatnonzero(is_chosen[len(owner) :])
    f = owner[members]
    points[members] = surface.points(f, barycentric_weights(grid.packing.corners[f], texels[members]))
    nearest = NearestPoints._make(part[beyond] for part in grid.nearest)
    ends, _ = trace_from_border(surface, grid.border, grid.sides, nearest, texels[len(owner) + beyond])
    there = nearest.rim | (ends.complete & mapped_triangles[ends.triangle])
    points[len(owner) + beyond[there]] = surface.points(ends.triangle, ends.weights)[there]
    return points


def cut_overlaps(surface: FlatSurface, triangle_piece: Index, gutter_mm: float) -> Index:
    """Cut charts along straight lines where their gutters overlap; return the piece of each triangle (f,).

    A piece is an uncut chart or a part of a cut chart. Charts are cut until the remaining overlap is too
    short for a cut, or until the new gutters would take too much area.

    triangle_piece : (f,) index of the chart of each triangle before the cuts, -1 for triangles in no chart
    gutter_mm : width of the gutters [mm]
    """
    done, count = np.full(len(triangle_piece), -1, np.int64), 0
    order = np.argsort(triangle_piece, kind="stable")[np.count_nonzero(triangle_piece < 0) :]
    starts = np.flatnonzero(np.diff(triangle_piece[order])) + 1
    queue = [(members, 0) for members in np.split(order, starts) if len(members)]
    budget_mm2 = _MAX_RELATIVE_AREA_GROWTH * surface.area_mm2[order].sum()
    while queue:
        members, depth = queue.pop()
        parts = (
            _cut_piece(surface, triangle_piece >= 0, members, gutter_mm)
            if depth < _MAX_SUCCESSIVE_CUTS
            else None
        )
        cost_mm2 = 0.0 if parts is None else 2 * gutter_mm * _cut_length_mm(surface, members, parts)
        if parts is None or cost_mm2 > budget_mm2:
            done[members] = count
            count += 1
        else:
            budget_mm2 -= cost_mm2
            queue += [(members[parts == k], depth + 1) for k in range(int(parts.max()) + 1)]
    return done


def _cut_length_mm(surface: FlatSurface, member_triangles: Index, part_of_triangle: Index) -> float:
    """Return the length of all triangle sides along which a chart piece is cut into parts [mm].

    member_triangles : (t,) indices of the piece's triangles
    part_of_triangle : (t,) index of the part to which each of these triangles belongs
    """
    part_of = np.full(len(surface.uv), -1, np.int64)
    part_of[member_triangles] = part_of_triangle
    other = part_of[surface.uv_neighbour[member_triangles]]
    length = np.linalg.norm(
        np.roll(surface.corners[member_triangles], -1, axis=1) - surface.corners[member_triangles], axis=2
    )
    return float(length[(other >= 0) & (other != part_of_triangle[:, None])].sum()) / 2


def _cut_piece(
    surface: FlatSurface, mapped_triangles: Mask, member_triangles: Index, gutter_mm: float
) -> Index | None:
    """Cut a chart piece where its gutters meet; return the part of each triangle (t,), None for no cut.

    mapped_triangles : (f,) mask of triangles that belong to any piece
    member_triangles : (t,) indices of the piece's triangles
    gutter_mm : width of the gutters [mm]
    """
    conflicts = find_gutter_conflicts(surface, mapped_triangles, member_triangles, gutter_mm)
    reach = gutter_mm / conflicts.texel_mm
    part = np.zeros(len(member_triangles), np.int64)
    for row, cluster in enumerate(_conflict_clusters(conflicts, reach), start=1):
        if len(cluster) * conflicts.texel_mm < _MIN_CONFLICT_LENGTH_GUTTER_WIDTHS * gutter_mm:
            continue
        overlap = conflicts._replace(first=conflicts.first[cluster], second=conflicts.second[cluster])
        normal, offset, separated = _best_cut_line(overlap, reach)
        half = surface.uv[member_triangles].mean(axis=1) * conflicts.texels_per_uv @ normal > offset
        across = float(np.count_nonzero(np.abs(conflicts.inside @ normal - offset) < 0.5))
        around = float(separated + 2 * reach)
        if separated < _MIN_CONFLICTS_PER_CUT_TEXEL * min(across, around):
            continue
        if across <= around:
            return _connected_parts(surface, member_triangles, half.astype(np.int64), gutter_mm)
        part[_conflict_strip(surface, member_triangles, overlap, half, reach) & (part == 0)] = row
    return _connected_parts(surface, member_triangles, part, gutter_mm)


def _conflict_clusters(conflicts: Conflicts, gutter_width_texels: float) -> list[Index]:
    """Group neighbouring conflicts between gutters; return the indices of the conflicts in each group.

    gutter_width_texels : gutter width [texel]
    """
    cells = np.floor(
        (conflicts.first + conflicts.second) / 2 / (_CLUSTER_CELL_GUTTER_WIDTHS * gutter_width_texels)
    ).astype(np.int64)
    cells, cell_of = np.unique(cells, axis=0, return_inverse=True)
    adjacent = np.abs(cells[:, None] - cells).max(axis=2) <= 1
    label = label_components(len(cells), *np.nonzero(adjacent))[cell_of.reshape(-1)]
    return [np.flatnonzero(label == k) for k in range(label.max(initial=-1) + 1)]


def _near_any_target(points: Doubles, target_points: Doubles, max_distance: float) -> Mask:
    """Return the mask (...) of points (..., 2) within about `max_distance` of any target point.

    points : (..., 2) points to test
    target_points : (n, 2) points to which the distances are measured
    """
    cell = max_distance / _CELLS_PER_GUTTER
    low = np.floor(target_points.min(axis=0) / cell) - _CELLS_PER_GUTTER - 1
    disc = np.argwhere(
        np.hypot(*(np.indices((2 * _CELLS_PER_GUTTER + 1,) * 2) - _CELLS_PER_GUTTER)) <= _CELLS_PER_GUTTER
    )
    centre = np.floor(target_points / cell - low).astype(np.int64) - _CELLS_PER_GUTTER
    found = np.zeros(centre.max(axis=0) + 2 * _CELLS_PER_GUTTER + 2, np.bool_)
    found[tuple(np.moveaxis(centre[:, None] + disc, 2, 0))] = True
    index = np.floor(points / cell - low).astype(np.int64)
    index = np.where(((index >= 0) & (index < found.shape)).all(axis=-1, keepdims=True), index, 0)
    return np.asarray(found[index[..., 0], index[..., 1]])  # cell 0 is always empty


def _conflict_strip(
    surface: FlatSurface,
    member_triangles: Index,
    conflicts: Conflicts,
    one_side_mask: Mask,
    gutter_width_texels: float,
) -> Mask:
    """Return the mask (t,) of the triangles to cut off from a piece so that two of its gutters are separated.

    These are the triangles that lie near conflicts between the gutters and on one side of a line that
    separates the conflicts. Of the two sides, the one with the smaller area of such triangles is chosen.

    member_triangles : (t,) indices of the piece's triangles
    conflicts : conflicts that the line separates
    one_side_mask : (t,) True for triangles on one side of the line, False for those on the other side
    gutter_width_texels : gutter width [texel]
    """
    corners = surface.uv[member_triangles] * conflicts.texels_per_uv
    points = np.concatenate((corners, corners.mean(axis=1, keepdims=True)), axis=1)
    near = np.asarray(
        _near_any_target(
            points, np.concatenate((conflicts.first, conflicts.second)), gutter_width_texels
        ).any(axis=1)
    )
    area = surface.area_mm2[member_triangles]
    return near & (
        one_side_mask
        if area[near & one_side_mask].sum() < area[near & ~one_side_mask].sum()
        else ~one_side_mask
    )


def _best_cut_line(conflicts: Conflicts, gutter_width_texels: float) -> tuple[Doubles, float, int]:
    """Return the best line along which to cut a chart piece: its normal and offset, and a count.

    A line separates a conflict if the two border points of the conflict are on different sides of the line.
    The best line separates the most conflicts for the length of the cut. The count is the number of conflicts
    that the line separates.

    gutter_width_texels : gutter width [texel]
    """
    close = conflicts.inside[
        _near_any_target(
            conflicts.inside, np.concatenate((conflicts.first, conflicts.second)), gutter_width_texels
        )
    ]
    best, line = -1.0, (np.array([1.0, 0.0]), 0.0, 0)
    for angle in np.arange(_LINE_DIRECTION_COUNT) * np.pi / _LINE_DIRECTION_COUNT:
        normal = np.array([np.cos(angle), np.sin(angle)])
        one, other, inside = (points @ normal for points in (conflicts.first, conflicts.second, close))
        low, high = np.minimum(one, other), np.maximum(one, other)
        first, last = low.min(), high.max()
        offsets = first + (last - first) * (np.arange(_LINE_OFFSET_COUNT)[:, None] + 0.5) / _LINE_OFFSET_COUNT
        separated = np.count_nonzero((low < offsets) & (offsets < high), axis=1)
        length = np.count_nonzero(np.abs(inside - offsets) < 0.5, axis=1)
        score = separated / (length + _CUT_LENGTH_BIAS_TEXELS * len(one))
        found = int(score.argmax())
        if score[found] > best:
            best, line = score[found], (normal, float(offsets[found, 0]), int(separated[found]))
    return line


def _connected_parts(
    surface: FlatSurface, member_triangles: Index, part_of_triangle: Index, gutter_mm: float
) -> Index | None:
    """Split the parts of a cut piece into connected parts, and merge small parts into neighbours.

    A small part is merged into its largest neighbour. Returns the index of each triangle's part (t,), or None
    if only one part remains.

    member_triangles : (t,) indices of the triangles of the cut piece
    part_of_triangle : (t,) index of the part to which the cut assigns each of these triangles
    gutter_mm : width of the gutters [mm]
    """
    index = np.full(len(surface.uv), -1, np.int64)
    index[member_triangles] = np.arange(len(member_triangles))
    there = index[surface.uv_neighbour[member_triangles]]
    neighbour = np.where(there >= 0, there, np.arange(len(member_triangles))[:, None])
    part_of_triangle = connected_pieces(part_of_triangle, neighbour)
    area = np.bincount(part_of_triangle, surface.area_mm2[member_triangles])
    is_small = area[part_of_triangle] < _MIN_PART_AREA_GUTTER_WIDTHS2 * gutter_mm**2
    largest_neighbour = np.take_along_axis(
        part_of_triangle[neighbour], area[part_of_triangle[neighbour]].argmax(axis=1)[:, None], axis=1
    )[:, 0]
    part_of_triangle = connected_pieces(np.where(is_small, largest_neighbour, part_of_triangle), neighbour)
    return part_of_triangle if part_of_triangle.max() > 0 else None
