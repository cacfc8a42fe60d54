"""A piece of a surface cut out and divided until its edges are short; the surface stays where it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.errors import refuse
from dermis.mesh.geometry import edges, triangle_areas

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_TRIANGLES = 8_000_000
_ROUNDING = 1e-9
_PIECES = (
    np.array([[0, 1, 2]]),
    np.array([[0, 3, 2], [3, 1, 2]]),
    np.array([[3, 1, 4], [0, 3, 4], [0, 4, 2]]),
    np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]),
    np.array([[3, 1, 4], [0, 3, 2], [3, 4, 2]]),
)
"""What a triangle becomes when 0, 1, 2 or 3 sides are halved, the first ones first; 3 + k halves side k.

With 2, four corners are left over: the last entry cuts them by the other diagonal.
"""


@dataclass(frozen=True)
class Patch:
    """Fine triangles, and where they lie on the coarse ones that they divide.

    positions : (n, 3) [mm]
    triangles : (f, 3)
    parent : (f,) the coarse triangle that each lies on
    weights : (f, 3, 3) barycentric weights of each corner in the parent
    centre_mm, radius_mm : the ball whose inside may be judged; the patch goes on around it [mm]
    """

    positions: Floats
    triangles: Index
    parent: Index
    weights: Floats
    centre_mm: Floats
    radius_mm: float

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Vertices (n,) within the radius of the centre."""
        return self.holds(self.positions)

    def holds(self, positions: Floats) -> NDArray[np.bool_]:
        """Which positions (m, 3) [mm] lie within the radius of the centre."""
        inside: NDArray[np.bool_] = np.linalg.norm(positions - self.centre_mm, axis=1) <= self.radius_mm
        return inside

    def vertex_places(self) -> tuple[Index, Floats]:
        """A coarse triangle (n,) and the weights in it (n, 3) for each vertex: read maps with them."""
        triangle, weights = np.zeros(len(self.positions), np.int64), np.zeros((len(self.positions), 3))
        triangle[self.triangles] = self.parent[:, None]
        # a vertex that several parents share must get the weights of the one that it got
        rows, columns = np.nonzero(triangle[self.triangles] == self.parent[:, None])
        weights[self.triangles[rows, columns]] = self.weights[rows, columns]
        return triangle, weights

    def find(self, triangle: Index, barycentric: Floats) -> tuple[Index, Floats]:
        """The fine triangle (m,) at each place, -1 off the patch, and the weights in it (m, 3).

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
            hit = inside.min(axis=1) >= -_ROUNDING
            found[left[hit]], weights[left[hit]] = order[child[hit]], inside[hit]
            turn += 1
            left = left[~hit]
            left = left[count[left] > turn]
        return found, weights

    def interpolate(self, values: Floats, fine: Index, weights: Floats) -> Floats:
        """`values` (..., n, c) of the vertices at places that `find` gave, (..., m, c)."""
        corners = self.triangles[fine]
        return sum((weights[:, k, None] * values[..., corners[:, k], :] for k in range(3)), np.zeros(()))


def refine_patch(
    positions: ArrayLike,
    triangles: ArrayLike,
    centre_mm: ArrayLike,
    radius_mm: float,
    edge_mm: float,
    margin_mm: float,
) -> Patch:
    """What lies within radius and margin of a centre, cut into triangles with edges of at most `edge_mm`.

    Edges that are too long are halved, and the triangles on both sides with them, so no crack opens; every
    new vertex lies on a flat old triangle, and the surface stays exactly as it was.

    positions, triangles : (n, 3) and (f, 3) of the coarse surface, welded [mm]
    centre_mm : (3,); distance from it is along straight lines, which are never longer than along the surface
    radius_mm : of what is to be judged, infinite for the whole surface
    edge_mm : `edge_for` of the variances to come
    margin_mm : `margin_for` of them

    Raises DermisError when nothing lies there, or more than 8 million triangles would.
    """
    places, corners = np.asarray(positions, np.float64), np.asarray(triangles, np.int64)
    centre = np.asarray(centre_mm, np.float64)
    if not (edge_mm > 0 and radius_mm > 0 and margin_mm >= 0):
        came = f"{edge_mm:g}, {radius_mm:g} and {margin_mm:g} came"
        refuse("patch", "edge and radius above 0, margin not below", came, "Correct them")
    parent = np.arange(len(corners))
    weights = np.broadcast_to(np.eye(3), (len(corners), 3, 3)).copy()
    while True:
        near = _near(places[corners], centre, radius_mm + margin_mm, edge_mm)
        corners, parent, weights = corners[near], parent[near], weights[near]
        ends, of_side, _ = edges(corners)
        long = np.linalg.norm(places[ends[:, 0]] - places[ends[:, 1]], axis=1) > edge_mm
        if not long.any():
            break
        middle = np.full(len(ends), -1)
        middle[long] = len(places) + np.arange(int(long.sum()))
        places = np.vstack((places, places[ends[long]].mean(axis=1)))
        corners, parent, weights = _divide(places, corners, parent, weights, middle[of_side].reshape(3, -1).T)
    used, compact = np.unique(corners, return_inverse=True)
    return Patch(places[used], compact.reshape(-1, 3), parent, weights, centre, float(radius_mm))


def _near(corners: Floats, centre: Floats, reach: float, edge_mm: float) -> NDArray[np.bool_]:
    """Triangles (f,) some point of which may lie within reach: by the ball around their middle.

    Refuses when there is none, or when those wholly within reach will become too many: no triangle with edges
    of at most `edge_mm` has more area than the equilateral one.
    """
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    distance = np.linalg.norm(middle - centre, axis=1)
    near: NDArray[np.bool_] = distance <= reach + size
    if not near.any():
        refuse("patch", "surface around its centre", f"there is none at {centre.tolist()}", "Move the centre")
    within = triangle_areas(corners[distance + size <= reach]).sum()
    count = within / (np.sqrt(3) / 4 * edge_mm**2)
    if count > MOST_TRIANGLES:
        came = f"edges of {edge_mm:g} mm make more than {MOST_TRIANGLES}"
        refuse("patch", "a few million triangles", came, "Take longer edges or a smaller radius")
    return near


def _divide(
    places: Floats, corners: Index, parent: Index, weights: Floats, middle: Index
) -> tuple[Index, Index, Floats]:
    """Triangles, parents and weights after the sides with a middle vertex (f, 3; -1 for none) are halved."""
    halved = middle >= 0
    count = halved.sum(axis=1)
    first = np.select([count == 1, count == 2], [halved.argmax(axis=1), halved.argmin(axis=1) + 1], 0)
    turned = (np.arange(len(corners))[:, None], (first[:, None] + np.arange(3)) % 3)
    vertices = np.hstack((corners[turned], middle[turned]))
    apart = weights[turned]
    apart = np.concatenate((apart, (apart + np.roll(apart, -1, axis=1)) / 2), axis=1)
    diagonals = places[vertices[:, [0, 3]]] - places[vertices[:, [4, 2]]]
    first_longer = np.subtract(*np.square(diagonals).sum(axis=2).T) > 0
    case = np.where((count == 2) & first_longer, len(_PIECES) - 1, count)
    pieces = []
    for number, pattern in enumerate(_PIECES):
        chosen = case == number
        pieces.append(
            (
                vertices[chosen][:, pattern].reshape(-1, 3),
                np.repeat(parent[chosen], len(pattern)),
                apart[chosen][:, pattern].reshape(-1, 3, 3),
            )
        )
    divided, parents, finer = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    return divided, parents, finer
