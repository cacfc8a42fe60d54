"""Diffusion of light along a surface by the heat equation: the reference for blurs on uv maps.

Blurring along a surface by a Gaussian of variance v is the diffusion of heat for the time v/2. The heat
equation is solved on the triangles of the surface, so the result depends on no uv map, seam or stretch. No
light leaves through open borders (Neumann condition).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.triangles import Floats, Index, triangle_edges
from dermis.base.errors import refuse
from dermis.mesh.geometry import sum_by_index
from dermis.mesh.mesh import Mesh

if TYPE_CHECKING:
    from scipy.sparse import csc_array

TIME_STEPS_PER_LEVEL = 12
"""Time steps per level; the peak of a diffused point is then within 0.2 % of its limit for many steps."""
EDGES_PER_SIGMA = 2.0
"""Smallest permitted number of edge lengths per standard deviation of the blur that a level adds [-]."""
PATCH_MARGIN_SIGMAS = 4.0
"""Width of a patch's margin, in standard deviations of the widest blur [-].

Beyond this distance, a Gaussian has 0.03 % of its energy.
"""

_TRAPEZOIDAL_STEP_FRACTION = 2 - np.sqrt(2)
"""Fraction of a time step that the trapezoidal stage covers; with this value, both stages use one matrix."""


def diffuse_on_surface(
    positions: ArrayLike,
    triangles: ArrayLike,
    vertex_values: ArrayLike,
    variances_mm2: ArrayLike,
    step_count: int = TIME_STEPS_PER_LEVEL,
) -> Floats:
    """Return vertex values (k, n, c), blurred along the surface by a Gaussian of each of k variances.

    The blur by each variance, called a level, starts from the result of the next smaller variance. Each time
    step uses TR-BDF2, a scheme of second order that, unlike the Crank-Nicolson scheme, does not oscillate
    near small bright spots.

    positions : (n, 3) vertex positions without duplicates, see `welded_surface` [mm]
    triangles : (f, 3) vertex indices
    vertex_values : (n, c) values at the vertices, interpolated linearly on the triangles
    variances_mm2 : (k,) increasing variances above 0 [mm2]
    step_count : number of time steps per level

    Raises DermisError when an edge is too long: longer than half the standard deviation of the blur that a
    level adds to the previous level. `refine_patch` makes edges shorter.

    Source: [Bank1985] for TR-BDF2, [BobenkoSpringborn2007] for the Laplacian.
    """
    vertices, corners = _checked_surface(positions, triangles)
    checked_values = _checked_vertex_values(vertex_values, len(vertices))
    added_variances = np.diff(_checked_variances(variances_mm2), prepend=0.0)
    _check_resolution(vertices, corners, variances_mm2, step_count)
    mass, stiffness = mass_and_stiffness(
        intrinsic_delaunay(intrinsic_triangulation(vertices, corners)), len(vertices)
    )
    levels = [checked_values]
    for variance in added_variances:
        levels.append(_diffuse_vertex_values(mass, stiffness, levels[-1], float(variance), step_count))
    return np.stack(levels[1:])


def welded_surface(mesh: Mesh) -> tuple[Floats, Index]:
    """Return a mesh without duplicate vertices at uv seams: positions (p, 3) [mm] and triangles (f, 3)."""
    return mesh.points_mm, mesh.point[mesh.triangles].astype(np.int64)


def longest_edge_mm(positions: ArrayLike, triangles: ArrayLike) -> float:
    """Return the length of the longest edge of a triangle mesh [mm]."""
    vertices, corners = _checked_surface(positions, triangles)
    return float(triangle_edges(vertices, corners)[2].max())


def resolved_levels(variances_mm2: ArrayLike, edge_mm: float) -> NDArray[np.bool_]:
    """Return the mask (k,) of Gaussian blurs that a mesh with edges of a given length resolves.

    Each blur is computed from the next smaller blur that is resolved, by an additional blur whose variance is
    the difference of their variances. It is resolved if the standard deviation of this additional blur is at
    least two edge lengths.

    variances_mm2 : (k,) increasing variances of the blurs, above 0 [mm2]
    edge_mm : length of the longest edge, see `longest_edge_mm` [mm]
    """
    min_variance, last_variance, allowed = (EDGES_PER_SIGMA * edge_mm) ** 2, 0.0, []
    for variance in _checked_variances(variances_mm2):
        allowed.append(bool(variance - last_variance >= min_variance * (1 - 1e-9)))
        last_variance = float(variance) if allowed[-1] else last_variance
    return np.array(allowed)


def max_edge_mm(variances_mm2: ArrayLike) -> float:
    """Return the largest edge length at which a mesh resolves all given Gaussian blurs [mm].

    Each blur is computed from the next smaller one by an additional blur, whose variance is the difference of
    their variances. The length is half the smallest standard deviation of these additional blurs.

    variances_mm2 : (k,) increasing variances of the blurs, above 0 [mm2]
    """
    min_variance = float(np.diff(_checked_variances(variances_mm2), prepend=0.0).min())
    return float(np.sqrt(min_variance)) / EDGES_PER_SIGMA


def patch_margin_mm(variances_mm2: ArrayLike) -> float:
    """Return how far a surface patch must extend beyond the ball in which its blurred values are valid [mm].

    This margin is four standard deviations of the widest blur.

    variances_mm2 : (k,) increasing variances of the blurs [mm2]
    """
    return PATCH_MARGIN_SIGMAS * float(np.sqrt(_checked_variances(variances_mm2)[-1]))


def _diffuse_vertex_values(
    mass: csc_array, stiffness: csc_array, vertex_values: Floats, variance_mm2: float, step_count: int
) -> Floats:
    """Return vertex values after diffusion by the heat equation for the time `variance_mm2` / 2.

    mass, stiffness : matrices from `mass_and_stiffness`
    step_count : number of time steps
    """
    step = variance_mm2 / 2 / step_count
    solve = _lu_solver((mass + (_TRAPEZOIDAL_STEP_FRACTION / 2 * step) * stiffness).tocsc())
    explicit = (mass - (_TRAPEZOIDAL_STEP_FRACTION / 2 * step) * stiffness).tocsr()
    intermediate_weight = 1 / (_TRAPEZOIDAL_STEP_FRACTION * (2 - _TRAPEZOIDAL_STEP_FRACTION))
    mass_rows = mass.tocsr()
    for _ in range(step_count):
        intermediate = solve(explicit @ vertex_values)
        vertex_values = solve(
            mass_rows @ (intermediate_weight * intermediate + (1 - intermediate_weight) * vertex_values)
        )
    return vertex_values


def _lu_solver(matrix: csc_array) -> Callable[[Floats], Floats]:
    """Return a function that solves the linear system of a matrix, by sparse LU without pivoting.

    matrix : symmetric, positive definite matrix
    """
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return factors.solve


def _checked_surface(positions: ArrayLike, triangles: ArrayLike) -> tuple[Floats, Index]:
    vertices, corners = np.asarray(positions, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    shaped = vertices.shape == (len(vertices), 3) and corners.shape == (len(corners), 3) and len(corners) > 0
    if not (shaped and np.isfinite(vertices).all() and 0 <= corners.min() <= corners.max() < len(vertices)):
        actual = f"got shapes {vertices.shape} and {corners.shape}, or invalid values"
        refuse("surface", "finite positions (n, 3) and indices (f, 3)", actual, "Correct the arrays")
    return vertices, corners


def _checked_vertex_values(values_at_vertices: ArrayLike, vertex_count: int) -> Floats:
    vertex_values = np.asarray(values_at_vertices, dtype=np.float64)
    if not (
        vertex_values.ndim == 2 and len(vertex_values) == vertex_count and np.isfinite(vertex_values).all()
    ):
        actual = f"got shape {vertex_values.shape}, or values that are not finite"
        refuse("surface diffusion", f"finite values ({vertex_count}, c)", actual, "Give one row per vertex")
    return vertex_values


def _checked_variances(variances_mm2: ArrayLike) -> Floats:
    variances = np.asarray(variances_mm2, dtype=np.float64)
    if not (variances.ndim == 1 and len(variances) and (np.diff(variances, prepend=0.0) > 0).all()):
        refuse("surface diffusion", "increasing variances above 0", f"got {variances.tolist()}", "Sort them")
    return variances


def _check_resolution(vertices: Floats, corners: Index, variances: ArrayLike, step_count: int) -> None:
    if step_count < 1:
        refuse("surface diffusion", "at least one time step", f"got {step_count}", "Choose 8 or more")
    longest = longest_edge_mm(vertices, corners)
    allowed = resolved_levels(variances, longest)
    if not allowed.all():
        fine = ", ".join(f"{variance:g}" for variance in np.asarray(variances)[allowed]) or "none of them"
        actual = f"got {longest:.3g} mm, which resolves only the variances {fine}"
        expected = f"edges of at most {max_edge_mm(variances):.3g} mm, half the sigma that a level adds"
        refuse("surface diffusion", expected, actual, "Refine the surface (refine_patch) or use wider levels")


_MIN_RELATIVE_TRIANGLE_SLACK = 1e-5
"""Smallest amount by which two sides of a triangle together exceed the third side, relative to the mean edge
length; flatter triangles have unusable angles."""
_COTANGENT_FLIP_TOLERANCE = 1e-6
"""Tolerance of edge flips: an edge is flipped if the cotangents of its two opposite angles sum to less than
minus this tolerance. If the corners of its two triangles lie on one circle, the cotangents sum to 0."""
_MAX_FLIP_SWEEPS = 1000


@dataclass(frozen=True)
class IntrinsicTriangulation:
    """Triangulation given by its edge lengths alone, without positions in space.

    corners : (f, 3) vertex indices; side k runs from corner k to corner k + 1
    side : (f, 3) edge index of each side
    length : (e,) length of each edge [mm]
    """

    corners: Index
    side: Index
    length: Floats

    def areas(self) -> Floats:
        """Return the areas (f,) by Kahan's form of Heron's formula, which is accurate for slivers [mm2]."""
        c, b, a = np.sort(self.length[self.side], axis=1).T
        product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
        return np.asarray(np.sqrt(np.maximum(product, 0)) / 4)

    def cotangents(self) -> Floats:
        """Return the cotangent (f, 3) of the angle opposite each side."""
        square = self.length[self.side] ** 2
        law_of_cosines = square.sum(axis=1, keepdims=True) - 2 * square
        return np.asarray(law_of_cosines / (4 * self.areas()[:, None]))


def intrinsic_triangulation(positions: Floats, triangles: Index) -> IntrinsicTriangulation:
    """Return the intrinsic triangulation of a triangle mesh.

    If a triangle is degenerate, a tiny length is added to all edges.

    positions : (n, 3) vertex positions [mm]
    triangles : (f, 3) vertex indices

    Source: [SharpCrane2020], intrinsic mollification.
    """
    _, side, length = triangle_edges(positions, triangles)
    slack = length[side].sum(axis=1) - 2 * length[side].max(axis=1)
    missing = max(0.0, _MIN_RELATIVE_TRIANGLE_SLACK * float(length.mean()) - float(slack.min()))
    return IntrinsicTriangulation(triangles, side, length + missing)


def intrinsic_delaunay(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """Return the intrinsic Delaunay triangulation of the same surface, computed by edge flips.

    The two angles opposite each edge then sum to at most pi, so heat flows from hot to cold along every edge,
    even if the mesh has obtuse angles. An edge is not flipped if it lies on a border, if more than two
    triangles share it, or if its two triangles have opposite orientations.

    Source: [BobenkoSpringborn2007]; [Fisher2007] for flips by lengths.
    """
    corners, side, length = (
        triangulation.corners.copy(),
        triangulation.side.copy(),
        triangulation.length.copy(),
    )
    flipped = IntrinsicTriangulation(corners, side, length)
    flippable = _interior_edges(corners, side, len(length))
    # Each flip lowers the Dirichlet energy of every function on the triangulation, so the loop ends.
    for _ in range(_MAX_FLIP_SWEEPS):
        weight = sum_by_index(side.ravel(), flipped.cotangents().reshape(-1, 1), len(length))[:, 0]
        illegal = flippable & (weight < -_COTANGENT_FLIP_TOLERANCE)
        if not illegal.any():
            break
        _flip_edges(flipped, _independent_flips(side, illegal, weight))
    return flipped


def _interior_edges(corners: Index, side_edges: Index, edge_count: int) -> NDArray[np.bool_]:
    """Return the mask (e,) of edges that exactly two triangles of equal orientation share.

    corners, side_edges : vertex and edge indices of the triangles' sides, as in `IntrinsicTriangulation`
    edge_count : number of edges
    """
    forward = (corners < np.roll(corners, -1, axis=1)).ravel()
    uses = np.bincount(side_edges.ravel(), minlength=edge_count)
    along = np.bincount(side_edges.ravel()[forward], minlength=edge_count)
    return np.asarray((uses == 2) & (along == 1))


def _independent_flips(side_edges: Index, non_delaunay: NDArray[np.bool_], cotangent_weight: Floats) -> Index:
    """Return non-Delaunay edges that can be flipped together, because no two of them share a triangle.

    An edge is selected if it is the worst edge of both of its triangles. The result (2, m) has for each
    selected edge the indices of its two triangle sides in `side_edges.ravel()`.

    side_edges : (f, 3) edge index of each side
    non_delaunay : (e,) mask of non-Delaunay edges
    cotangent_weight : (e,) cotangent weight of each edge; the smallest is worst
    """
    worst_first = np.flatnonzero(non_delaunay)[np.argsort(cotangent_weight[non_delaunay], kind="stable")]
    rank = np.full(len(non_delaunay), len(non_delaunay), dtype=np.int64)
    rank[worst_first] = np.arange(len(worst_first))
    side_rank = rank[side_edges]
    worst_side = side_rank.argmin(axis=1)
    side_index = np.arange(len(side_edges)) * 3 + worst_side
    side_index = side_index[side_rank.ravel()[side_index] < len(non_delaunay)]
    edge = side_edges.ravel()[side_index]
    mutual = side_index[np.bincount(edge, minlength=len(non_delaunay))[edge] == 2]
    return np.asarray(mutual[np.argsort(side_edges.ravel()[mutual], kind="stable")].reshape(-1, 2).T)


def _flip_edges(triangulation: IntrinsicTriangulation, side_pairs: Index) -> None:
    """Flip edges in place: replace each edge (a, b), shared by triangles (a, b, c) and (b, a, d), by (c, d).

    side_pairs : (2, m) indices of the two triangle sides of each edge, from `_independent_flips`
    """
    (left, i), (right, j) = (np.divmod(side_index, 3) for side_index in side_pairs)
    a, b, c = (triangulation.corners[left, (i + k) % 3] for k in range(3))
    d = triangulation.corners[right, (j + 2) % 3]
    ab, bc, ca = (triangulation.side[left, (i + k) % 3] for k in range(3))
    ad, db = (triangulation.side[right, (j + k) % 3] for k in (1, 2))
    along_c, up_c = _apex_coordinates(
        triangulation.length[ab], triangulation.length[ca], triangulation.length[bc]
    )
    along_d, down_d = _apex_coordinates(
        triangulation.length[ab], triangulation.length[ad], triangulation.length[db]
    )
    triangulation.length[ab] = np.hypot(along_c - along_d, up_c + down_d)
    triangulation.corners[left], triangulation.side[left] = (
        np.column_stack((c, d, b)),
        np.column_stack((ab, db, bc)),
    )
    triangulation.corners[right], triangulation.side[right] = (
        np.column_stack((d, c, a)),
        np.column_stack((ab, ca, ad)),
    )


def _apex_coordinates(
    base_length: Floats, start_side_length: Floats, end_side_length: Floats
) -> tuple[Floats, Floats]:
    """Return the position of each triangle's apex along the base, and its height above the base [mm].

    base_length : length of the base [mm]
    start_side_length : length of the side from the start of the base to the apex [mm]
    end_side_length : length of the side from the end of the base to the apex [mm]
    """
    along = (base_length**2 + start_side_length**2 - end_side_length**2) / (2 * base_length)
    return along, np.sqrt(np.maximum(start_side_length**2 - along**2, 0))


def mass_and_stiffness(
    triangulation: IntrinsicTriangulation, vertex_count: int
) -> tuple[csc_array, csc_array]:
    """Return the mass matrix M [mm2] and the stiffness matrix K [-] of linear finite elements, each (n, n).

    The heat equation is M du/dt = -K u for vertex values u. M is the mean of the lumped and the consistent
    mass matrix, whose errors nearly cancel. Each row of M sums to the area of its vertex, and each row of K
    sums to 0. A vertex without triangles keeps its value.

    vertex_count : number n of vertices

    Source: [PinkallPolthier1993] for the cotangents.
    """
    from scipy.sparse import coo_array, diags_array

    start = triangulation.corners
    end = np.roll(start, -1, axis=1)
    conductance = triangulation.cotangents() / 2
    corner_area = np.repeat(triangulation.areas()[:, None], 3, axis=1)

    def assemble_matrix(off_diagonal: Floats, diagonal: Floats) -> csc_array:
        """Return a sparse symmetric matrix (n, n), summed over the sides of all triangles.

        off_diagonal : (f, 3) entry between the vertices at the start and the end of each side
        diagonal : (f, 3) entry of the vertex at the start of each side
        """
        rows = np.concatenate([index.ravel() for index in (start, end, start)])
        columns = np.concatenate([index.ravel() for index in (end, start, start)])
        values = np.concatenate([entry.ravel() for entry in (off_diagonal, off_diagonal, diagonal)])
        return coo_array((values, (rows, columns)), shape=(vertex_count, vertex_count)).tocsc()

    stiffness = assemble_matrix(-conductance, conductance + np.roll(conductance, 1, axis=1))
    isolated = np.bincount(start.ravel(), minlength=vertex_count) == 0
    identity = diags_array(isolated.astype(np.float64))
    return (assemble_matrix(corner_area / 24, corner_area / 4) + identity).tocsc(), stiffness
