"""Mesh parts from polygons whose corners have separate indices of position, uv and normal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np

from dermis.base.arrays import Doubles, Index, Mask
from dermis.base.errors import refuse
from dermis.formats import size_limits as limits
from dermis.formats.parts import MaterialGroup, MeshPart
from dermis.mesh.geometry import compact_vertices, expand_runs

TriangleOrder = Literal["by polygon", "by kind"]


@dataclass(frozen=True)
class Polygons:
    """Polygons of a file.

    counts : (n,) number of corners of each polygon, at least 3
    corners : (c, 3) indices of position, uv and normal of each corner; a missing uv or normal has the index
        -1
    positions : (p, 3) positions to which the corners refer
    uv : (t, 2) uv coordinates to which the corners refer
    normals : (m, 3) normals to which the corners refer
    colours : (p, 3) linear colours of the positions, or None
    """

    counts: Index
    corners: Index
    positions: Doubles
    uv: Doubles
    normals: Doubles
    colours: Doubles | None = None

    def has_uv(self) -> Mask:
        """Return the mask (n,) of polygons whose corners all have uv."""
        return np.minimum.reduceat(self.corners[:, 1], np.cumsum(self.counts) - self.counts) >= 0

    def mesh_parts(
        self, groups: Sequence[MaterialGroup], group_index: Index, triangle_order: TriangleOrder
    ) -> list[MeshPart]:
        """Return a mesh part for each group that has polygons, in the order of the groups' first polygons.

        groups : groups of the file, some of which may have no polygons
        group_index : (n,) index in `groups` for each polygon
        triangle_order : order of the triangles, see `triangulate`

        Polygons without uv become separate parts, whose uv is None.
        """
        keys, first, key = np.unique(2 * group_index + ~self.has_uv(), return_index=True, return_inverse=True)
        by_first = np.argsort(first)
        rank = np.argsort(by_first)[key]
        polygons = np.argsort(rank, kind="stable")
        counts = self.counts[polygons]
        corners = self.corners[expand_runs((np.cumsum(self.counts) - self.counts)[polygons], counts)[1]]
        ends = np.cumsum(np.bincount(rank))[:-1]
        pieces = np.split(counts, ends), np.split(corners, np.cumsum(counts)[ends - 1])
        chosen = [groups[one] for one in keys[by_first] // 2]
        return [self._build_part(*piece, triangle_order) for piece in zip(chosen, *pieces, strict=True)]

    def _build_part(
        self,
        material_group: MaterialGroup,
        corner_counts: Index,
        corners: Index,
        triangle_order: TriangleOrder,
    ) -> MeshPart:
        """Return polygons as a part with one vertex for each combination of position, normal and uv."""
        vertex, uv, normal = corners.T + np.array([[0], [1], [1]])
        if not uv.all():
            uv = np.zeros_like(uv)
        is_tied = all(not own.any() or np.array_equal(own, vertex + 1) for own in (uv, normal))
        if is_tied and len(vertex) >= len(self.positions):
            used, index = compact_vertices(vertex)
            vertex, uv, normal = used, uv.any() * (used + 1), normal.any() * (used + 1)
        else:
            sizes = len(self.normals) + 1, len(self.uv) + 1
            keys, index = np.unique((vertex * sizes[0] + normal) * sizes[1] + uv, return_inverse=True)
            keys, uv = np.divmod(keys, sizes[1])
            vertex, normal = np.divmod(keys, sizes[0])
        triangles, quads = triangulate(corner_counts, triangle_order)
        return MeshPart(
            material_group,
            self.positions[vertex] + 0.0,  # converts -0 to 0
            self.uv[uv - 1] if uv.all() else None,
            np.where(normal[:, None], self.normals[normal - 1] + 0.0, np.nan) if normal.any() else None,
            index[triangles],
            quads=quads,
            colours=None if self.colours is None else self.colours[vertex],
        )


def missing_uv_notes(polygons: Polygons) -> list[str]:
    """Return a list with a note if some polygons have uv and others have none, else an empty list."""
    has_uv = polygons.has_uv()
    missing = np.count_nonzero(~has_uv)
    return [f"{missing:,} of {len(has_uv):,} faces have no uv"] if 0 < missing < len(has_uv) else []


def check_polygon_sizes(path: Path, corner_counts: Index) -> None:
    """Refuse n polygons if one has too many corners, or if they have too many triangles in total.

    corner_counts : (n,) number of corners of each polygon
    """
    corners, triangles = int(corner_counts.max(initial=0)), int(np.maximum(corner_counts - 2, 0).sum())
    advice = "Divide it into smaller ones"
    limits.check_limit(path, corners, limits.MAX_POLYGON_CORNERS, "corners of a face", advice)
    limits.check_limit(path, triangles, limits.MAX_TRIANGLES, "triangles", limits.DECIMATE_ADVICE)


def without_small_polygons(corner_counts: Index, corners: Index) -> tuple[Index, Index, Mask, list[str]]:
    """Remove polygons of fewer than three corners.

    Returns `corner_counts` and `corners` of the remaining polygons, the mask (n,) that selects these
    polygons, and a list with a note if any polygons were removed.
    """
    kept = corner_counts >= 3
    if kept.all():
        return corner_counts, corners, kept, []
    note = f"{np.count_nonzero(~kept):,} faces of fewer than three corners are left out"
    return corner_counts[kept], corners[np.repeat(kept, corner_counts)], kept, [note]


def refuse_without_faces(path: Path, point_count: int) -> NoReturn:
    """Refuse a file without faces.

    point_count : number of points in the file
    """
    actual = "it is a cloud of points without faces" if point_count else "it has none"
    advice = "Make a mesh of the points first (in MeshLab: Filters > Remeshing)"
    refuse(
        path, "a mesh of triangles", actual, advice if point_count else "Export the head as a polygon mesh"
    )


def triangulate(corner_counts: Index, triangle_order: TriangleOrder) -> tuple[Index, Index]:
    """Triangulate polygons as fans; return triangles, and the pairs of triangles that are halves of quads.

    Each triangle (f, 3) is three indices of corners, and each pair (q, 2) is two indices of triangles.

    corner_counts : (n,) number of corners of each polygon; corners are numbered consecutively
    triangle_order : "by polygon", or "by kind": all triangles first, then the first halves of all quads, then
        the second halves, then all other polygons; if all polygons are quads, "by kind" is always used
    """
    sizes = corner_counts - 2
    polygon, step = expand_runs(np.zeros_like(sizes), sizes)
    corner = (np.cumsum(corner_counts) - corner_counts)[polygon]
    triangles = np.column_stack((corner, corner + step + 1, corner + step + 2))
    is_quad = corner_counts[polygon] == 4
    second = is_quad & (step == 1)
    triangles[second] = np.roll(triangles[second], -1, axis=1)
    if triangle_order == "by kind" or is_quad.all():
        kind = np.where(is_quad, 1 + step, np.where(corner_counts[polygon] == 3, 0, 3))
        sequence = np.argsort(kind, kind="stable")
        triangles, is_quad, second = triangles[sequence], is_quad[sequence], second[sequence]
    return triangles, np.column_stack((np.flatnonzero(is_quad & ~second), np.flatnonzero(second)))
