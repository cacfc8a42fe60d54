"""Light diffused along a surface like heat: what a blur should give on any uv map.

A Gaussian of variance v on a surface is heat diffused for the time v/2. It is solved on the triangles
themselves, so no uv map, seam or stretch plays a part. Open borders are insulated (Neumann).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.surface_diffusion_operators import delaunay, intrinsic, mass_and_stiffness
from dermis.apps.truths.triangles import Floats, Index, sides
from dermis.base.errors import refuse
from dermis.mesh.geometry import sum_at
from dermis.mesh.mesh import Mesh

if TYPE_CHECKING:
    from scipy.sparse import csc_array

STEPS = 12
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
    steps: int = STEPS,
) -> Floats:
    """`values` blurred along the surface by a Gaussian of each variance, (k, n, c), in the unit of `values`.

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
    places, corners = _surface(positions, triangles)
    given = _values(values, len(places))
    added = np.diff(_rising(variances_mm2), prepend=0.0)
    _check_resolved(places, corners, variances_mm2, steps)
    mass, stiffness = mass_and_stiffness(delaunay(intrinsic(places, corners)), len(places))
    levels = [given]
    for variance in added:
        levels.append(_diffused(mass, stiffness, levels[-1], float(variance), steps))
    return np.stack(levels[1:])


def welded(mesh: Mesh) -> tuple[Floats, Index]:
    """Positions (p, 3) [mm] without duplicates, and the triangles (f, 3) among them in their order."""
    positions = np.zeros((int(mesh.point.max()) + 1, 3))
    positions[mesh.point] = mesh.positions
    return positions, mesh.point[mesh.triangles].astype(np.int64)


def vertex_areas(positions: ArrayLike, triangles: ArrayLike) -> Floats:
    """The area that each vertex stands for (n,) [mm2]; diffusion keeps the sum of values times areas."""
    places, corners = _surface(positions, triangles)
    surface = delaunay(intrinsic(places, corners))
    thirds = np.repeat(surface.areas() / 3, 3)
    return sum_at(surface.corners.ravel(), thirds[:, None], len(places))[:, 0]


def longest_edge_mm(positions: ArrayLike, triangles: ArrayLike) -> float:
    """Length of the longest edge [mm]."""
    places, corners = _surface(positions, triangles)
    return float(sides(places, corners)[2].max())


def resolved(variances_mm2: Sequence[float] | Floats, edge_mm: float) -> NDArray[np.bool_]:
    """Which levels (k,) edges of this length allow: those that add a sigma of two edges to the last allowed.

    variances_mm2 : (k,) rising, above 0 [mm2]
    edge_mm : the longest edge, see `longest_edge_mm`
    """
    least, last, allowed = (EDGES_PER_SIGMA * edge_mm) ** 2, 0.0, []
    for variance in _rising(variances_mm2):
        allowed.append(bool(variance - last >= least * (1 - 1e-9)))
        last = float(variance) if allowed[-1] else last
    return np.array(allowed)


def edge_for(variances_mm2: Sequence[float] | Floats) -> float:
    """Longest edge that allows all levels [mm]: half the smallest standard deviation that one adds."""
    least = float(np.diff(_rising(variances_mm2), prepend=0.0).min())
    return float(np.sqrt(least)) / EDGES_PER_SIGMA


def margin_for(variances_mm2: Sequence[float] | Floats) -> float:
    """How far a patch must extend beyond its radius [mm]: four standard deviations of the widest level."""
    return MARGIN_SIGMAS * float(np.sqrt(_rising(variances_mm2)[-1]))


def _diffused(mass: csc_array, stiffness: csc_array, values: Floats, variance: float, steps: int) -> Floats:
    """`values` after the time variance/2."""
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
    """Solver for a symmetric, positive definite matrix: no pivoting, and an ordering that suits surfaces."""
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return factors.solve


def _surface(positions: ArrayLike, triangles: ArrayLike) -> tuple[Floats, Index]:
    places, corners = np.asarray(positions, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    shaped = places.shape == (len(places), 3) and corners.shape == (len(corners), 3) and len(corners) > 0
    if not (shaped and np.isfinite(places).all() and 0 <= corners.min() <= corners.max() < len(places)):
        came = f"arrays of shape {places.shape} and {corners.shape} came, or numbers that are not"
        refuse(
            "surface", "finite positions (n, 3) and triangles (f, 3) among them", came, "Correct the arrays"
        )
    return places, corners


def _values(values: ArrayLike, count: int) -> Floats:
    given = np.asarray(values, dtype=np.float64)
    if not (given.ndim == 2 and len(given) == count and np.isfinite(given).all()):
        came = f"an array of shape {given.shape} came, or numbers that are not finite"
        refuse("surface diffusion", f"finite values ({count}, c)", came, "Give each vertex its values")
    return given


def _rising(variances_mm2: Sequence[float] | Floats) -> Floats:
    variances = np.asarray(variances_mm2, dtype=np.float64)
    if not (variances.ndim == 1 and len(variances) and (np.diff(variances, prepend=0.0) > 0).all()):
        refuse("surface diffusion", "variances above 0 that rise", f"{variances.tolist()} came", "Sort them")
    return variances


def _check_resolved(places: Floats, corners: Index, variances: Sequence[float] | Floats, steps: int) -> None:
    if steps < 1:
        refuse("surface diffusion", "at least one step of time", f"{steps} came", "Choose 8 or more")
    longest = longest_edge_mm(places, corners)
    allowed = resolved(variances, longest)
    if not allowed.all():
        fine = ", ".join(f"{variance:g}" for variance in np.asarray(variances)[allowed]) or "none of them"
        came = f"one of {longest:.3g} mm came, which allows of the variances {fine}"
        expected = f"edges of at most {edge_for(variances):.3g} mm, half of the least sigma that a level adds"
        refuse(
            "surface diffusion", expected, came, "Refine the surface (refine_patch) or ask for wider levels"
        )
