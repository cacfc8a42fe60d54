"""Light diffused along a surface like heat: what a blur should give on any uv map.

A Gaussian of variance v on a surface is heat diffused for the time v/2. It is solved on the triangles
themselves, so no uv map, seam or stretch plays a part. Open borders are insulated (Neumann).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.triangles import Floats, Index, triangle_edges
from dermis.base.errors import refuse
from dermis.mesh.geometry import sum_at
from dermis.mesh.mesh import Mesh

if TYPE_CHECKING:
    from scipy.sparse import csc_array

STEPS_PER_LEVEL = 12
"""Time steps for each level: the peak of a diffused point is then within 0.2 % of the limit."""
EDGES_PER_SIGMA = 2.0
MARGIN_SIGMAS = 4.0
"""Beyond them lie 0.03 % of a Gaussian, too little to matter."""

_GAMMA = 2 - np.sqrt(2)
"""Share of the step that the trapezoidal stage covers; with this one both stages solve the same matrix."""


def diffuse_on_surface(
    positions: ArrayLike,
    triangles: ArrayLike,
    values: ArrayLike,
    variances_mm2: Sequence[float] | Floats,
    steps: int = STEPS_PER_LEVEL,
) -> Floats:
    """Return `values` blurred along the surface by a Gaussian of each variance, (k, n, c).

    Each level starts from the one before. TR-BDF2 advances time: it is of second order and, unlike Crank and
    Nicolson's rule, does not ring on points of light.

    positions : (n, 3) without duplicates: weld what uv seams have split, see `welded` [mm]
    triangles : (f, 3)
    values : (n, c) at the vertices, linear in between
    variances_mm2 : (k,) rising, above 0 [mm2]
    steps : time steps for each level

    Raises DermisError when edges are longer than half the standard deviation that a level adds.
    `refine_patch` makes them shorter.

    Source: [Bank1985] for TR-BDF2, [BobenkoSpringborn2007] for the Laplacian.
    """
    places, corners = _checked_surface(positions, triangles)
    given = _checked_values(values, len(places))
    added = np.diff(_checked_variances(variances_mm2), prepend=0.0)
    _check_resolution(places, corners, variances_mm2, steps)
    mass, stiffness = mass_and_stiffness(delaunay(intrinsic_triangulation(places, corners)), len(places))
    levels = [given]
    for variance in added:
        levels.append(_diffuse(mass, stiffness, levels[-1], float(variance), steps))
    return np.stack(levels[1:])


def welded_surface(mesh: Mesh) -> tuple[Floats, Index]:
    """Return positions (p, 3) [mm] without duplicates, and the triangles (f, 3) among them in their order."""
    return mesh.points_mm, mesh.point[mesh.triangles].astype(np.int64)


def vertex_areas(positions: ArrayLike, triangles: ArrayLike) -> Floats:
    """Return the area of each vertex (n,) [mm2]; diffusion keeps the sum of values times areas."""
    places, corners = _checked_surface(positions, triangles)
    surface = delaunay(intrinsic_triangulation(places, corners))
    thirds = np.repeat(surface.areas() / 3, 3)
    return sum_at(surface.corners.ravel(), thirds[:, None], len(places))[:, 0]


def longest_edge_mm(positions: ArrayLike, triangles: ArrayLike) -> float:
    """Return the length of the longest edge [mm]."""
    places, corners = _checked_surface(positions, triangles)
    return float(triangle_edges(places, corners)[2].max())


def resolved_levels(variances_mm2: Sequence[float] | Floats, edge_mm: float) -> NDArray[np.bool_]:
    """Return the levels (k,) that edges allow: those that add a sigma of two edges to the last allowed.

    variances_mm2 : (k,) rising, above 0 [mm2]
    edge_mm : the longest edge, see `longest_edge_mm`
    """
    least, last, allowed = (EDGES_PER_SIGMA * edge_mm) ** 2, 0.0, []
    for variance in _checked_variances(variances_mm2):
        allowed.append(bool(variance - last >= least * (1 - 1e-9)))
        last = float(variance) if allowed[-1] else last
    return np.array(allowed)


def max_edge_mm(variances_mm2: Sequence[float] | Floats) -> float:
    """Return longest edge that allows all levels [mm]: half the smallest standard deviation that one adds."""
    least = float(np.diff(_checked_variances(variances_mm2), prepend=0.0).min())
    return float(np.sqrt(least)) / EDGES_PER_SIGMA


def patch_margin_mm(variances_mm2: Sequence[float] | Floats) -> float:
    """Return the margin of a patch beyond its radius [mm]: four standard deviations of the widest level."""
    return MARGIN_SIGMAS * float(np.sqrt(_checked_variances(variances_mm2)[-1]))


def _diffuse(mass: csc_array, stiffness: csc_array, values: Floats, variance: float, steps: int) -> Floats:
    """Return `values` after the time variance/2."""
    step = variance / 2 / steps
    solve = _factorised((mass + (_GAMMA / 2 * step) * stiffness).tocsc())
    ahead = (mass - (_GAMMA / 2 * step) * stiffness).tocsr()
    first = 1 / (_GAMMA * (2 - _GAMMA))
    held = mass.tocsr()
    for _ in range(steps):
        middle = solve(ahead @ values)
        values = solve(held @ (first * middle + (1 - first) * values))
    return values


def _factorised(matrix: csc_array) -> Callable[[Floats], Floats]:
    """Return a solver of a symmetric, positive definite matrix, without pivoting, ordered for surfaces."""
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return factors.solve


def _checked_surface(positions: ArrayLike, triangles: ArrayLike) -> tuple[Floats, Index]:
    places, corners = np.asarray(positions, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    shaped = places.shape == (len(places), 3) and corners.shape == (len(corners), 3) and len(corners) > 0
    if not (shaped and np.isfinite(places).all() and 0 <= corners.min() <= corners.max() < len(places)):
        came = f"arrays of shape {places.shape} and {corners.shape} came, or numbers that are not"
        refuse(
            "surface", "finite positions (n, 3) and triangles (f, 3) among them", came, "Correct the arrays"
        )
    return places, corners


def _checked_values(values: ArrayLike, count: int) -> Floats:
    given = np.asarray(values, dtype=np.float64)
    if not (given.ndim == 2 and len(given) == count and np.isfinite(given).all()):
        came = f"an array of shape {given.shape} came, or numbers that are not finite"
        refuse("surface diffusion", f"finite values ({count}, c)", came, "Give each vertex its values")
    return given


def _checked_variances(variances_mm2: Sequence[float] | Floats) -> Floats:
    variances = np.asarray(variances_mm2, dtype=np.float64)
    if not (variances.ndim == 1 and len(variances) and (np.diff(variances, prepend=0.0) > 0).all()):
        refuse("surface diffusion", "variances above 0 that rise", f"{variances.tolist()} came", "Sort them")
    return variances


def _check_resolution(places: Floats, corners: Index, variances: Sequence[float] | Floats, steps: int) -> None:
    if steps < 1:
        refuse("surface diffusion", "at least one step of time", f"{steps} came", "Choose 8 or more")
    longest = longest_edge_mm(places, corners)
    allowed = resolved_levels(variances, longest)
    if not allowed.all():
        fine = ", ".join(f"{variance:g}" for variance in np.asarray(variances)[allowed]) or "none of them"
        came = f"one of {longest:.3g} mm came, which allows of the variances {fine}"
        expected = f"edges of at most {max_edge_mm(variances):.3g} mm, half of the least sigma that a level adds"
        refuse(
            "surface diffusion", expected, came, "Refine the surface (refine_patch) or ask for wider levels"
        )


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
        """Return areas (f,) [mm2] by Kahan's form of Heron's formula, which is safe for slivers."""
        c, b, a = np.sort(self.length[self.side], axis=1).T
        product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
        areas: Floats = np.sqrt(np.maximum(product, 0)) / 4
        return areas

    def cotangents(self) -> Floats:
        """Return the cotangent of the angle opposite each side (f, 3)."""
        square = self.length[self.side] ** 2
        facing = square.sum(axis=1, keepdims=True) - 2 * square
        cotangents: Floats = facing / (4 * self.areas()[:, None])
        return cotangents


def intrinsic_triangulation(positions: Floats, triangles: Index) -> Triangulation:
    """Return triangles by edge lengths; all edges grow by the same tiny amount if one is degenerate.

    positions : (n, 3) [mm]
    triangles : (f, 3)

    Source: [SharpCrane2020], intrinsic mollification.
    """
    _, side, length = triangle_edges(positions, triangles)
    slack = length[side].sum(axis=1) - 2 * length[side].max(axis=1)
    missing = max(0.0, _SLACK * float(length.mean()) - float(slack.min()))
    return Triangulation(triangles, side, length + missing)


def delaunay(given: Triangulation) -> Triangulation:
    """Return the same surface with edges flipped until the two angles opposite each sum to at most pi.

    Heat then flows from hot to cold along every edge, whatever obtuse angles the mesh has. Borders, and edges
    where more than two triangles meet or two have opposite orientations, stay.

    Source: [BobenkoSpringborn2007]; [Fisher2007] for flips by lengths.
    """
    corners, side, length = given.corners.copy(), given.side.copy(), given.length.copy()
    now = Triangulation(corners, side, length)
    flippable = _interior_edges(corners, side, len(length))
    # Each flip lowers the Dirichlet energy of every function on the surface, so this ends.
    for _ in range(_MAX_SWEEPS):
        weight = sum_at(side.ravel(), now.cotangents().reshape(-1, 1), len(length))[:, 0]
        bad = flippable & (weight < -_COCIRCULAR)
        if not bad.any():
            break
        _flip_edges(now, _independent_flips(side, bad, weight))
    return now


def _interior_edges(corners: Index, side: Index, count: int) -> NDArray[np.bool_]:
    """Return edges (e,) shared by two triangles of the same orientation."""
    forward = (corners < np.roll(corners, -1, axis=1)).ravel()
    uses = np.bincount(side.ravel(), minlength=count)
    along = np.bincount(side.ravel()[forward], minlength=count)
    shared: NDArray[np.bool_] = (uses == 2) & (along == 1)
    return shared


def _independent_flips(side: Index, bad: NDArray[np.bool_], weight: Floats) -> Index:
    """Return bad edges no two of which share a triangle, as indices (2, m) of their sides in `side.ravel()`.

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


def _flip_edges(now: Triangulation, pairs: Index) -> None:
    """Flip each edge ab between triangles abc and bad to cd, in place."""
    (left, i), (right, j) = (np.divmod(place, 3) for place in pairs)
    a, b, c = (now.corners[left, (i + k) % 3] for k in range(3))
    d = now.corners[right, (j + 2) % 3]
    ab, bc, ca = (now.side[left, (i + k) % 3] for k in range(3))
    ad, db = (now.side[right, (j + k) % 3] for k in (1, 2))
    along_c, up_c = _apex_coordinates(now.length[ab], now.length[ca], now.length[bc])
    along_d, down_d = _apex_coordinates(now.length[ab], now.length[ad], now.length[db])
    now.length[ab] = np.hypot(along_c - along_d, up_c + down_d)
    now.corners[left], now.side[left] = np.column_stack((c, d, b)), np.column_stack((ab, db, bc))
    now.corners[right], now.side[right] = np.column_stack((d, c, a)), np.column_stack((ab, ca, ad))


def _apex_coordinates(base: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return the position of the apex along the base, from the end at side `first`, and its height [mm]."""
    along = (base**2 + first**2 - second**2) / (2 * base)
    return along, np.sqrt(np.maximum(first**2 - along**2, 0))


def mass_and_stiffness(surface: Triangulation, count: int) -> tuple[csc_array, csc_array]:
    """Return mass M [mm2] and stiffness K [-] (n, n) of linear elements, with M du/dt = -K u for heat.

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
        """Return entries `between` start and end of each side and `own` at its start."""
        rows = np.concatenate([index.ravel() for index in (start, end, start)])
        columns = np.concatenate([index.ravel() for index in (end, start, start)])
        values = np.concatenate([entry.ravel() for entry in (between, between, own)])
        return coo_array((values, (rows, columns)), shape=(count, count)).tocsc()

    stiffness = assembled(-conduct, conduct + np.roll(conduct, 1, axis=1))
    alone = np.bincount(start.ravel(), minlength=count) == 0
    rest = coo_array((alone.astype(np.float64), (np.arange(count), np.arange(count))), shape=(count, count))
    return (assembled(share / 24, share / 4) + rest).tocsc(), stiffness
