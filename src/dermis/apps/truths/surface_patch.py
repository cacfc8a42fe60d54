"""A patch cut out of a surface and subdivided until its edges are short, without changing its shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.surface_diffusion import max_edge_mm, patch_margin_mm, welded_surface
from dermis.apps.truths.triangles import Floats, Index, split_triangles, triangle_edges
from dermis.base.errors import refuse
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Mesh

MAX_TRIANGLES = 8_000_000
_BARYCENTRIC_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Patch:
    """Fine triangles, and where they lie on the coarse triangles they came from.

    positions : (n, 3) [mm]
    triangles : (f, 3)
    parent : (f,) the coarse triangle that each lies on
    weights : (f, 3, 3) barycentric weights of each corner in the parent
    centre_mm, radius_mm : the ball inside which results are valid; the patch extends beyond it [mm]
    """

    positions: Floats
    triangles: Index
    parent: Index
    weights: Floats
    centre_mm: Floats
    radius_mm: float

    def holds(self, positions: Floats) -> NDArray[np.bool_]:
        """Return which positions (m, 3) [mm] lie within the radius of the centre."""
        inside: NDArray[np.bool_] = np.linalg.norm(positions - self.centre_mm, axis=1) <= self.radius_mm
        return inside

    def vertex_places(self) -> tuple[Index, Floats]:
        """Return a coarse triangle (n,) and the weights in it (n, 3) for each vertex, to read maps with."""
        triangle, weights = np.zeros(len(self.positions), np.int64), np.zeros((len(self.positions), 3))
        triangle[self.triangles] = self.parent[:, None]
        # A vertex shared by several parents must get the weights in the parent it was assigned.
        rows, columns = np.nonzero(triangle[self.triangles] == self.parent[:, None])
        weights[self.triangles[rows, columns]] = self.weights[rows, columns]
        return triangle, weights

    def find(self, triangle: Index, barycentric: Floats) -> tuple[Index, Floats]:
        """Return the fine triangle (m,) at each point, -1 off the patch, and the weights in it (m, 3).

        triangle : (m,) coarse triangles
        barycentric : (m, 3) weights in them
        """
        order = np.argsort(self.parent, kind="stable")
        first = np.searchsorted(self.parent[order], triangle, "left")
        count = np.searchsorted(self.parent[order], triangle, "right") - first
        found, weights = np.full(len(triangle), -1, dtype=np.int64), np.zeros((len(triangle), 3))
        inverse = np.linalg.inv(self.weights)[order]
        left = np.flatnonzero(count > 0)
        turn = 0
        while len(left):
            child = first[left] + turn
            inside = np.einsum("mi,mij->mj", barycentric[left], inverse[child])
            hit = inside.min(axis=1) >= -_BARYCENTRIC_TOLERANCE
            found[left[hit]], weights[left[hit]] = order[child[hit]], inside[hit]
            turn += 1
            left = left[~hit]
            left = left[count[left] > turn]
        return found, weights

    def interpolate(self, values: Floats, fine: Index, weights: Floats) -> Floats:
        """`values` (..., n, c) of the vertices, interpolated at points that `find` gave (..., m, c)."""
        corners = self.triangles[fine]
        return sum((weights[:, k, None] * values[..., corners[:, k], :] for k in range(3)), np.zeros(()))


def mesh_patch(
    mesh: Mesh, centre_mm: ArrayLike, radius_mm: float, variances_mm2: Sequence[float] | Floats
) -> Patch:
    """Return the patch of a mesh, its uv seams welded, on which light of these variances can be diffused.

    centre_mm, radius_mm : the ball to judge in; an infinite radius takes the whole mesh [mm]
    variances_mm2 : (k,) rising; the smallest step between them sets the edges, the widest the margin [mm2]

    Short edges over a wide margin are costly: give narrow and wide levels patches of their own.
    """
    edge_mm, margin_mm = max_edge_mm(variances_mm2), patch_margin_mm(variances_mm2)
    return refine_patch(*welded_surface(mesh), centre_mm, radius_mm, edge_mm, margin_mm)


def refine_patch(
    positions: ArrayLike,
    triangles: ArrayLike,
    centre_mm: ArrayLike,
    radius_mm: float,
    edge_mm: float,
    margin_mm: float,
) -> Patch:
    """Return the surface within radius and margin of a centre, with edges of at most `edge_mm`.

    Edges that are too long are halved for both of their triangles, so no crack opens. New vertices lie on the
    flat old triangles, so the surface keeps its shape.

    positions, triangles : (n, 3) and (f, 3) of the coarse surface, welded [mm]
    centre_mm : (3,); distances from it are straight, and so never longer than along the surface
    radius_mm : of the ball to judge in, infinite for the whole surface
    edge_mm, margin_mm : `edge_for` and `margin_for` the variances to be diffused

    Raises DermisError when no surface lies there, or when there would be more than 8 million triangles.
    """
    places, corners = np.asarray(positions, np.float64), np.asarray(triangles, np.int64)
    centre = np.asarray(centre_mm, np.float64)
    if not (edge_mm > 0 and radius_mm > 0 and margin_mm >= 0):
        came = f"{edge_mm:g}, {radius_mm:g} and {margin_mm:g} came"
        refuse("patch", "edge and radius above 0, margin not below", came, "Correct them")
    parent = np.arange(len(corners))
    weights = np.broadcast_to(np.eye(3), (len(corners), 3, 3)).copy()
    while True:
        near = _triangles_in_reach(places[corners], centre, radius_mm + margin_mm, edge_mm)
        corners, parent, weights = corners[near], parent[near], weights[near]
        ends, side, length = triangle_edges(places, corners)
        long = length > edge_mm
        if not long.any():
            break
        middle = np.full(len(ends), -1)
        middle[long] = len(places) + np.arange(int(long.sum()))
        places = np.vstack((places, places[ends[long]].mean(axis=1)))
        corners, source, weights = split_triangles(corners, weights, middle[side], places)
        parent = parent[source]
    used, compact = np.unique(corners, return_inverse=True)
    return Patch(places[used], compact.reshape(-1, 3), parent, weights, centre, float(radius_mm))


def _triangles_in_reach(corners: Floats, centre: Floats, reach: float, edge_mm: float) -> NDArray[np.bool_]:
    """Return triangles (f,) that may have a point within reach, by the ball around their middle.

    Raises DermisError when there is none, or when those wholly within reach will become too many: a triangle
    with edges of at most `edge_mm` has at most the area of the equilateral one.
    """
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    distance = np.linalg.norm(middle - centre, axis=1)
    near: NDArray[np.bool_] = distance <= reach + size
    if not near.any():
        refuse("patch", "surface around its centre", f"there is none at {centre.tolist()}", "Move the centre")
    within = triangle_areas(corners[distance + size <= reach]).sum()
    count = within / (np.sqrt(3) / 4 * edge_mm**2)
    if count > MAX_TRIANGLES:
        came = f"edges of {edge_mm:g} mm make more than {MAX_TRIANGLES}"
        refuse("patch", "a few million triangles", came, "Take longer edges or a smaller radius")
    return near
