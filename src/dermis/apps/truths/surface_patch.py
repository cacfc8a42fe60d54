"""Patch of a surface, subdivided without change of shape until its edges are short enough for diffusion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.surface_diffusion import max_edge_mm, patch_margin_mm, welded_surface
from dermis.apps.truths.triangles import Floats, Index, split_triangles, triangle_edges
from dermis.base.errors import refuse
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Mesh

MAX_PATCH_TRIANGLES = 8_000_000
_BARYCENTRIC_TOLERANCE = 1e-9


@dataclass(frozen=True)
class SurfacePatch:
    """Patch of a mesh whose triangles are subdivided into smaller ones, here called patch triangles.

    positions : (n, 3) vertex positions [mm]
    triangles : (f, 3) vertex indices of the patch triangles
    parent : (f,) index of the mesh triangle that contains each patch triangle
    weights : (f, 3, 3) for each corner of each patch triangle, three barycentric weights in the mesh triangle
        that contains it
    centre_mm, radius_mm : ball inside which results are valid; the patch extends beyond it [mm]
    """

    positions: Floats
    triangles: Index
    parent: Index
    weights: Floats
    centre_mm: Floats
    radius_mm: float

    def contains(self, positions: Floats) -> NDArray[np.bool_]:
        """Return the mask (m,) of positions that are inside the ball where results are valid.

        positions : (m, 3) positions [mm]
        """
        return np.asarray(np.linalg.norm(positions - self.centre_mm, axis=1) <= self.radius_mm)

    def vertex_barycentrics(self) -> tuple[Index, Floats]:
        """Return a mesh triangle (n,) that contains each vertex, and the vertex's weights (n, 3) in it."""
        triangle, weights = np.zeros(len(self.positions), np.int64), np.zeros((len(self.positions), 3))
        triangle[self.triangles] = self.parent[:, None]
        # A vertex shared by several parents gets its weights in the parent that it was assigned to.
        rows, columns = np.nonzero(triangle[self.triangles] == self.parent[:, None])
        weights[self.triangles[rows, columns]] = self.weights[rows, columns]
        return triangle, weights

    def locate(self, triangle: Index, barycentric: Floats) -> tuple[Index, Floats]:
        """Return the patch triangle (m,) that contains each point, and the point's weights (m, 3) in it.

        Patch triangles are given as rows of `triangles`, and as -1 for points outside the patch. The weights
        are barycentric.

        triangle : (m,) mesh triangle that contains each point
        barycentric : (m, 3) barycentric weights of each point in its mesh triangle
        """
        order = np.argsort(self.parent, kind="stable")
        first = np.searchsorted(self.parent[order], triangle, "left")
        count = np.searchsorted(self.parent[order], triangle, "right") - first
        fine_triangle, weights = np.full(len(triangle), -1, dtype=np.int64), np.zeros((len(triangle), 3))
        inverse = np.linalg.inv(self.weights)[order]
        pending = np.flatnonzero(count > 0)
        candidate = 0
        while len(pending):
            child = first[pending] + candidate
            inside = np.einsum("mi,mij->mj", barycentric[pending], inverse[child])
            is_inside = inside.min(axis=1) >= -_BARYCENTRIC_TOLERANCE
            located = pending[is_inside]
            fine_triangle[located], weights[located] = order[child[is_inside]], inside[is_inside]
            candidate += 1
            pending = pending[~is_inside]
            pending = pending[count[pending] > candidate]
        return fine_triangle, weights

    def interpolate(self, vertex_values: Floats, small_triangles: Index, barycentric: Floats) -> Floats:
        """Return vertex values interpolated at m points, (..., m, c).

        vertex_values : (..., n, c) values at the vertices of the patch
        small_triangles : (m,) index of the patch triangle that contains each point, from `locate`
        barycentric : (m, 3) barycentric weights of each point in its patch triangle
        """
        corners = self.triangles[small_triangles]
        return sum(
            (barycentric[:, k, None] * vertex_values[..., corners[:, k], :] for k in range(3)), np.zeros(())
        )


def mesh_patch(mesh: Mesh, centre_mm: ArrayLike, radius_mm: float, variances_mm2: ArrayLike) -> SurfacePatch:
    """Return a patch of a mesh, with welded uv seams, on which light can be blurred by given variances.

    centre_mm, radius_mm : ball inside which results are valid; an infinite radius takes the whole mesh [mm]
    variances_mm2 : (k,) increasing variances; the smallest difference between successive variances determines
        the edge length, and the largest variance determines the margin [mm2]

    Short edges over a wide margin are costly, so use separate patches for small and large variances.
    """
    edge_mm, margin_mm = max_edge_mm(variances_mm2), patch_margin_mm(variances_mm2)
    return refine_patch(*welded_surface(mesh), centre_mm, radius_mm, edge_mm, margin_mm)


def refine_patch(
    positions: ArrayLike,
    triangles: ArrayLike,
    centre_mm: ArrayLike,
    radius_mm: float,
    max_edge_mm: float,
    margin_mm: float,
) -> SurfacePatch:
    """Return the surface within radius plus margin of a centre, with edges of at most `max_edge_mm`.

    Edges that are too long are halved in both adjacent triangles, so no crack opens. New vertices lie on the
    mesh triangles, so the surface keeps its shape.

    positions : (n, 3) vertex positions of the surface, with welded seams [mm]
    triangles : (f, 3) vertex indices of the surface
    centre_mm : (3,) centre of the ball inside which results are valid [mm]
    radius_mm : Euclidean radius of this ball; infinite for the whole surface [mm]
    max_edge_mm : largest edge length, from the function `max_edge_mm` [mm]
    margin_mm : distance by which the patch extends beyond the ball, from `patch_margin_mm` [mm]

    Raises DermisError when no triangle is within radius plus margin of the centre, or when there would be
    more than 8 million triangles.
    """
    vertices, corners = np.asarray(positions, np.float64), np.asarray(triangles, np.int64)
    centre = np.asarray(centre_mm, np.float64)
    if not (max_edge_mm > 0 and radius_mm > 0 and margin_mm >= 0):
        actual = f"got {max_edge_mm:g}, {radius_mm:g} and {margin_mm:g}"
        refuse("patch", "edge and radius above 0, margin not below", actual, "Correct them")
    parent = np.arange(len(corners))
    weights = np.broadcast_to(np.eye(3), (len(corners), 3, 3)).copy()
    while True:
        in_reach = _triangles_in_reach(vertices[corners], centre, radius_mm + margin_mm, max_edge_mm)
        corners, parent, weights = corners[in_reach], parent[in_reach], weights[in_reach]
        edge_ends, side, length = triangle_edges(vertices, corners)
        too_long = length > max_edge_mm
        if not too_long.any():
            break
        midpoint = np.full(len(edge_ends), -1)
        midpoint[too_long] = len(vertices) + np.arange(int(too_long.sum()))
        vertices = np.vstack((vertices, vertices[edge_ends[too_long]].mean(axis=1)))
        corners, source, weights = split_triangles(corners, weights, midpoint[side], vertices)
        parent = parent[source]
    used, compact = np.unique(corners, return_inverse=True)
    return SurfacePatch(vertices[used], compact.reshape(-1, 3), parent, weights, centre, float(radius_mm))


def _triangles_in_reach(
    corners: Floats, centre: Floats, reach_mm: float, edge_mm: float
) -> NDArray[np.bool_]:
    """Return the mask (f,) of triangles whose bounding balls are at least partly within reach of the centre.

    corners : (f, 3, 3) corner positions [mm]
    reach_mm : largest distance from the centre [mm]
    edge_mm : length to which `refine_patch` shortens all longer edges, by splitting triangles [mm]

    Raises DermisError when no triangle is within reach, or when the splitting would result in too many
    triangles. Their number is estimated from below: the area of the triangles that lie entirely within reach
    is divided by the area of an equilateral triangle with sides of `edge_mm`.
    """
    midpoint = corners.mean(axis=1)
    size = np.linalg.norm(corners - midpoint[:, None], axis=2).max(axis=1)
    distance = np.linalg.norm(midpoint - centre, axis=1)
    in_reach: NDArray[np.bool_] = distance <= reach_mm + size
    if not in_reach.any():
        refuse("patch", "surface around its centre", f"there is none at {centre.tolist()}", "Move the centre")
    within = triangle_areas(corners[distance + size <= reach_mm]).sum()
    count = within / (np.sqrt(3) / 4 * edge_mm**2)
    if count > MAX_PATCH_TRIANGLES:
        actual = f"edges of {edge_mm:g} mm make more than {MAX_PATCH_TRIANGLES}"
        refuse("patch", "a few million triangles", actual, "Take longer edges or a smaller radius")
    return in_reach
