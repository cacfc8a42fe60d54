"""Mass and stiffness matrices of heat on triangles, from their edge lengths alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.triangles import Floats, Index, sides
from dermis.mesh.geometry import sum_at

if TYPE_CHECKING:
    from scipy.sparse import csc_array

_SLACK = 1e-5
"""Least slack of the triangle inequality, over the mean edge: flatter triangles have no useful angles."""
_COCIRCULAR = 1e-6
"""Edges whose cotangents sum to less than minus this are flipped: points on a circle give 0 and rounding."""
_MAX_SWEEPS = 1000


@dataclass(frozen=True)
class Triangulation:
    """Triangles known by their edge lengths; their places in space do not matter.

    corners : (f, 3) vertices; side k runs from corner k to corner k + 1
    side : (f, 3) edge of each side
    length : (e,) of each edge [mm]
    """

    corners: Index
    side: Index
    length: Floats

    def areas(self) -> Floats:
        """Area of each triangle (f,) [mm2], by Kahan's form of Heron's formula, which is safe for slivers."""
        c, b, a = np.sort(self.length[self.side], axis=1).T
        product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
        areas: Floats = np.sqrt(np.maximum(product, 0)) / 4
        return areas

    def cotangents(self) -> Floats:
        """Cotangent of the angle opposite each side (f, 3)."""
        square = self.length[self.side] ** 2
        facing = square.sum(axis=1, keepdims=True) - 2 * square
        cotangents: Floats = facing / (4 * self.areas()[:, None])
        return cotangents


def intrinsic(positions: Floats, triangles: Index) -> Triangulation:
    """The triangles by their edge lengths; all edges grow by the same tiny amount if one is degenerate.

    positions : (n, 3) [mm]
    triangles : (f, 3)

    Source: [SharpCrane2020], intrinsic mollification.
    """
    _, side, length = sides(positions, triangles)
    slack = length[side].sum(axis=1) - 2 * length[side].max(axis=1)
    missing = max(0.0, _SLACK * float(length.mean()) - float(slack.min()))
    return Triangulation(triangles, side, length + missing)


def delaunay(given: Triangulation) -> Triangulation:
    """The same surface with edges flipped until the two angles opposite each sum to at most pi.

    Heat then flows from hot to cold along every edge, whatever obtuse angles the mesh has. Borders, and edges
    where more than two triangles meet or two have opposite orientations, stay.

    Source: [BobenkoSpringborn2007]; [Fisher2007] for flips by lengths.
    """
    corners, side, length = given.corners.copy(), given.side.copy(), given.length.copy()
    now = Triangulation(corners, side, length)
    flippable = _between_two(corners, side, len(length))
    # Each flip lowers the Dirichlet energy of every function on the surface, so this ends.
    for _ in range(_MAX_SWEEPS):
        weight = sum_at(side.ravel(), now.cotangents().reshape(-1, 1), len(length))[:, 0]
        bad = flippable & (weight < -_COCIRCULAR)
        if not bad.any():
            break
        _flip(now, _apart(side, bad, weight))
    return now


def _between_two(corners: Index, side: Index, count: int) -> NDArray[np.bool_]:
    """Edges (e,) shared by two triangles of the same orientation, which run along it in opposite ways."""
    forward = (corners < np.roll(corners, -1, axis=1)).ravel()
    uses = np.bincount(side.ravel(), minlength=count)
    along = np.bincount(side.ravel()[forward], minlength=count)
    shared: NDArray[np.bool_] = (uses == 2) & (along == 1)
    return shared


def _apart(side: Index, bad: NDArray[np.bool_], weight: Floats) -> Index:
    """Bad edges no two of which share a triangle, as indices (2, m) of their sides in `side.ravel()`.

    Each triangle votes for its worst edge. Edges with both votes are taken; the worst of all is among them.
    """
    worst_first = np.flatnonzero(bad)[np.argsort(weight[bad], kind="stable")]
    rank = np.full(len(bad), len(bad), dtype=np.int64)
    rank[worst_first] = np.arange(len(worst_first))
    of_side = rank[side]
    vote = of_side.argmin(axis=1)
    place = np.arange(len(side)) * 3 + vote
    place = place[of_side.ravel()[place] < len(bad)]
    edge = side.ravel()[place]
    both = place[np.bincount(edge, minlength=len(bad))[edge] == 2]
    pairs: Index = both[np.argsort(side.ravel()[both], kind="stable")].reshape(-1, 2).T
    return pairs


def _flip(now: Triangulation, pairs: Index) -> None:
    """Flip each edge ab between triangles abc and bad to cd, in place."""
    (left, i), (right, j) = (np.divmod(place, 3) for place in pairs)
    a, b, c = (now.corners[left, (i + k) % 3] for k in range(3))
    d = now.corners[right, (j + 2) % 3]
    ab, bc, ca = (now.side[left, (i + k) % 3] for k in range(3))
    ad, db = (now.side[right, (j + k) % 3] for k in (1, 2))
    along_c, up_c = _apex(now.length[ab], now.length[ca], now.length[bc])
    along_d, down_d = _apex(now.length[ab], now.length[ad], now.length[db])
    now.length[ab] = np.hypot(along_c - along_d, up_c + down_d)
    now.corners[left], now.side[left] = np.column_stack((c, d, b)), np.column_stack((ab, db, bc))
    now.corners[right], now.side[right] = np.column_stack((d, c, a)), np.column_stack((ab, ca, ad))


def _apex(base: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Where the apex lies along the base, measured from the end at side `first`, and its height [mm]."""
    along = (base**2 + first**2 - second**2) / (2 * base)
    return along, np.sqrt(np.maximum(first**2 - along**2, 0))


def mass_and_stiffness(surface: Triangulation, count: int) -> tuple[csc_array, csc_array]:
    """Mass M [mm2] and stiffness K [-] of linear elements, (n, n): M du/dt = -K u is du/dt = Laplacian of u.

    M is the mean of the lumped and the consistent mass. Their errors in the speed of heat are opposite and,
    on regular triangles, cancel to fourth order in the edge length. The rows of M sum to the vertices' areas,
    those of K to 0. A vertex without triangles keeps its value.

    count : n, the number of vertices

    Source: [PinkallPolthier1993] for the cotangents.
    """
    from scipy.sparse import coo_array

    start = surface.corners
    end = np.roll(start, -1, axis=1)
    conduct = surface.cotangents() / 2
    share = np.repeat(surface.areas()[:, None], 3, axis=1)

    def assembled(between: Floats, own: Floats) -> csc_array:
        """Entries `between` start and end of each side and `own` at its start."""
        rows = np.concatenate([index.ravel() for index in (start, end, start)])
        columns = np.concatenate([index.ravel() for index in (end, start, start)])
        values = np.concatenate([entry.ravel() for entry in (between, between, own)])
        return coo_array((values, (rows, columns)), shape=(count, count)).tocsc()

    stiffness = assembled(-conduct, conduct + np.roll(conduct, 1, axis=1))
    alone = np.bincount(start.ravel(), minlength=count) == 0
    rest = coo_array((alone.astype(np.float64), (np.arange(count), np.arange(count))), shape=(count, count))
    return (assembled(share / 24, share / 4) + rest).tocsc(), stiffness
