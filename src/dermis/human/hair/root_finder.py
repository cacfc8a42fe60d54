"""Hair roots of brows and lashes on the quads of the mean person, computed once for all people."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.human.hair import lashes
from dermis.human.hair.brows import brow_grid_points
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, quad_corners
from dermis.mesh.subdivide import subdivide

Index = NDArray[np.int64]
SIDE_SIGNS = 1.0, -1.0
"""Sign of x on the left and on the right side."""
_QUAD_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)  # corners in quad coordinates
_MIN_BARYCENTRIC_WEIGHT = -1e-9  # smallest barycentric weight of points that count as inside a triangle
_GRID_CELL_MM = 2.0  # cells of the grid of triangle lists
_GRID_LOW, _GRID_HIGH = (
    np.array([-70.0, -20.0]),
    np.array([70.0, 50.0]),
)  # bounds of that grid, around the brows [mm]
_HALF_QUAD_CORNERS = np.array([[0, 1, 2], [2, 3, 0]])  # corners of the two triangles of a quad


class _FrontTriangles(NamedTuple):
    """Front-facing triangles around the brows, with an xy grid that speeds up the search for a triangle.

    triangle_lists : (columns, rows, m) indices of the triangles that overlap each grid cell, padded with -1
    quad, half : (t,) index of the quad of each triangle, and 0 or 1 for the first or second half of the quad
    corner : (t, 3, 3) positions of the corners [mm]
    """

    triangle_lists: Index
    quad: Index
    half: Index
    corner: Doubles


class _LidEdge(NamedTuple):
    """Edge of a lid as a polyline of m points, with the quads that adjoin its segments.

    lengths_mm : (m,) arc length from the first point to each point [mm]
    quad : (m - 1,) index of the adjacent quad of each segment
    frame : (m - 1, 4, 2) bilinear coordinates, 0 or 1, of the four corners of this quad: the start of the
        segment, its end, and the corners opposite to its start and to its end
    """

    lengths_mm: Doubles
    quad: Index
    frame: Doubles


class RootFinder:
    """Finder of hair roots on a quad mesh.

    A root is searched either by its x and y as seen from the front, or by its position along the edge of an
    eyelid.

    mesh : control mesh
    points_mm : (p, 3) positions of the control points [mm]
    eyes_mm : (2, 3) centres of the left and the right eye [mm]
    subdivided_mesh : subdivided mesh of the same person
    """

    def __init__(self, mesh: Mesh, points_mm: Doubles, eyes_mm: Doubles, subdivided_mesh: Mesh) -> None:
        self.mesh, self.points_mm, self._eyes_mm = mesh, points_mm, eyes_mm
        self.subdivided_mesh = subdivided_mesh
        self._lid_edges: dict[tuple[tuple[int, ...], float], _LidEdge] = {}

    def front_roots(self, x: Doubles, y: Doubles) -> tuple[Roots, NDArray[np.bool_]]:
        """Return the roots at n positions seen from the front, and a mask (n,) of the valid roots.

        Each root is on the foremost triangle at its x and y. A root is invalid where there is no triangle.

        x, y : (n,) coordinates of the roots [mm]
        """
        front = self._front_triangles
        cell = np.floor((np.column_stack([x, y]) - _GRID_LOW) / _GRID_CELL_MM).astype(np.int64)
        last_cell = np.array(front.triangle_lists.shape[:2]) - 1
        triangles = front.triangle_lists[tuple(np.clip(cell, 0, last_cell).T)]
        query_index, column = np.nonzero(triangles >= 0)
        triangle = triangles[query_index, column]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = front.corner.take(triangle, axis=0).transpose(1, 2, 0)
        px, py = x[query_index], y[query_index]
        det = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        v = ((px - ax) * (cy - ay) - (cx - ax) * (py - ay)) / det
        w = ((bx - ax) * (py - ay) - (px - ax) * (by - ay)) / det
        u = 1 - v - w
        inside = np.flatnonzero(
            (u >= _MIN_BARYCENTRIC_WEIGHT) & (v >= _MIN_BARYCENTRIC_WEIGHT) & (w >= _MIN_BARYCENTRIC_WEIGHT)
        )
        z = (az + v * (bz - az) + w * (cz - az))[inside]
        front_index = np.full(len(x), -1)
        order = inside[np.argsort(z)]
        front_index[query_index[order]] = order  # the last assignment is the foremost triangle
        hit = front_index >= 0
        triangle, weights = (
            triangle[front_index],
            np.stack([u[front_index], v[front_index], w[front_index]], axis=-1),
        )
        position = np.einsum(
            "nk,nkc->nc", weights, _QUAD_CORNERS[_HALF_QUAD_CORNERS].take(front.half[triangle], axis=0)
        )
        quad = np.where(hit, front.quad[triangle], 0)
        return Roots(quad.astype(np.int32), np.clip(position, 0.0, 1.0).astype(np.float32)), hit

    @cached_property
    def once_subdivided_mesh(self) -> Mesh:
        """Return the mesh of the mean person after one level of subdivision.

        Its first points correspond to the control points.
        """
        return subdivide(self.mesh, 1)[0]

    @cached_property
    def brow_grid_roots(self) -> Roots:
        """Return roots at the nodes of `brow_grid_points` (left brow), then at the mirrored nodes (right)."""
        x, y = brow_grid_points()
        return self.front_roots(
            np.concatenate([side * x for side in SIDE_SIGNS]), np.tile(y, len(SIDE_SIGNS))
        )[0]

    def lid_edge_roots(
        self, lash_row: lashes.LashRow, side_sign: float, edge_position: Doubles, edge_distance: Doubles
    ) -> Roots:
        """Return lash roots near the edge of a lid, on the quads that adjoin the edge on the outside.

        lash_row : row of lashes on the lid
        side_sign : 1 for the left eye, -1 for the right eye
        edge_position : (n,) positions along the edge, as fractions of its arc length
        edge_distance : (n,) distances from the edge: 0 on the edge, 1 on the opposite side of the quad
        """
        key = lash_row.edge_points, side_sign
        if key not in self._lid_edges:
            self._lid_edges[key] = self._lid_edge(np.array(lash_row.edge_points), side_sign)
        lengths_mm, quad, frame = self._lid_edges[key]
        segment = np.clip(
            np.searchsorted(lengths_mm, edge_position * lengths_mm[-1], "right") - 1, 0, len(quad) - 1
        )
        t = (edge_position * lengths_mm[-1] - lengths_mm[segment]) / (
            lengths_mm[segment + 1] - lengths_mm[segment]
        )
        frame = frame[segment]
        low = (1 - t)[:, None] * frame[:, 0] + t[:, None] * frame[:, 1]
        high = (1 - t)[:, None] * frame[:, 2] + t[:, None] * frame[:, 3]
        position = (1 - edge_distance)[:, None] * low + edge_distance[:, None] * high
        return Roots(quad[segment].astype(np.int32), position.astype(np.float32))

    def _lid_edge(self, edge_points: Index, side_sign: float) -> _LidEdge:
        points, around, eye = self.points_mm, self._quad_points, self._eyes_mm[0 if side_sign > 0 else 1]
        edge_points = edge_points if side_sign > 0 else _mirrored_points(points, edge_points)
        distances = np.linalg.norm(points[around].mean(axis=1) - eye, axis=1)
        segments_mm = np.linalg.norm(np.diff(points[edge_points], axis=0), axis=1)
        lengths_mm = np.concatenate([[0], np.cumsum(segments_mm)])
        quads, frames = [], []
        for a, b in pairwise(edge_points.tolist()):
            both = np.flatnonzero((around == a).any(axis=1) & (around == b).any(axis=1))
            quad = int(both[distances[both].argmax()])
            i, j = (int(np.flatnonzero(around[quad] == p)[0]) for p in (a, b))
            quads.append(quad)
            frames.append(
                _QUAD_CORNERS[[i, j, (2 * i - j) % 4, (2 * j - i) % 4]]
            )  # a, b, and the corners opposite to them
        return _LidEdge(lengths_mm, np.array(quads), np.array(frames))

    @cached_property
    def _quad_points(self) -> NDArray[np.int32]:
        """Return the control point indices (q, 4) of all quads."""
        return quad_corners(self.mesh, np.arange(len(self.mesh.quads)))

    @cached_property
    def _front_triangles(self) -> _FrontTriangles:
        quad = np.repeat(np.arange(len(self.mesh.quads)), 2)
        half = np.tile([0, 1], len(self.mesh.quads))
        corner = self.points_mm[np.take_along_axis(self._quad_points[quad], _HALF_QUAD_CORNERS[half], axis=1)]
        (ab, ac), low, high = np.diff(corner[..., :2], axis=1).transpose(1, 0, 2), *_bounding_box(corner)
        ac = ab + ac
        visible = ab[:, 0] * ac[:, 1] - ac[:, 0] * ab[:, 1] > 1e-9
        visible &= ((high >= _GRID_LOW) & (low <= _GRID_HIGH)).all(axis=1)
        quad, half, corner = quad[visible], half[visible], corner[visible]
        shape = np.ceil((_GRID_HIGH - _GRID_LOW) / _GRID_CELL_MM).astype(np.int64)
        grid = (
            np.floor((bound[visible] - _GRID_LOW) / _GRID_CELL_MM).astype(np.int64) for bound in (low, high)
        )
        first, last = (np.clip(cell, 0, shape - 1) for cell in grid)
        cells: dict[tuple[int, int], list[int]] = {}
        for triangle, ((x0, y0), (x1, y1)) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
            for x in range(x0, x1 + 1):
                for y in range(y0, y1 + 1):
                    cells.setdefault((x, y), []).append(triangle)
        triangle_lists = np.full((*shape, max(map(len, cells.values()))), -1)
        for (x, y), triangles in cells.items():
            triangle_lists[x, y, : len(triangles)] = triangles
        return _FrontTriangles(triangle_lists, quad, half, corner)


def _bounding_box(corners: Doubles) -> tuple[Doubles, Doubles]:
    return corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)


def _mirrored_points(points_mm: Doubles, point_index: Index) -> Index:
    """Return for points of a symmetric head the indices of their mirror images in x.

    points_mm : (p, 3) all points of the head [mm]
    point_index : indices of the points to mirror
    """
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points_mm).query(points_mm[point_index] * [-1, 1, 1])[1], np.int64)


def eye_centres(mesh: Mesh) -> Doubles:
    """Return the centres (2, 3) of the left and the right eyeball of a mesh, found by material name [mm]."""
    names = [one.name for one in mesh.materials]
    centres = []
    for name in ("left eye", "right eye"):
        points = mesh.positions[np.unique(mesh.triangles[mesh.material == names.index(name)])]
        centres.append(0.5 * (points.min(axis=0) + points.max(axis=0)).astype(np.float64))
    return np.array(centres)
