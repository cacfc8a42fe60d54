"""Flattening of charts with little stretch, and repair of mirrored triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import edges, label_components, uv_cross

Complexes = NDArray[np.complex128]
_MAX_UNTANGLED_RINGS = 5  # number of rings of triangles around mirrored ones whose points may move
_REWEIGHTING_COUNT, _RIGID_ITERATION_COUNT = (
    6,
    8,
)  # number of updates of the weights, and of iterations after each


def planar_triangles(corners: NDArray[np.floating]) -> Complexes:
    """Return the corners (f, 3) of each triangle in its own plane, as complex numbers [mm].

    The first corner is at 0 and the second on the positive real axis, as seen from outside.

    corners : (f, 3, 3) positions of the corners [mm]
    """
    a, b, c = (np.asarray(corners[:, k], dtype=np.float64) for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    along = np.einsum("fi,fi->f", c - a, b - a) / length
    up = np.linalg.norm(np.cross(b - a, c - a), axis=1) / length
    return np.column_stack((np.zeros(len(a)), length, along + 1j * up))


def affine_coefficients(triangle_shapes: Complexes, positions: Complexes) -> tuple[Complexes, Complexes]:
    """Return a and b (f,) of affine maps z -> a z + b conj(z) + c of triangles in the complex plane.

    The singular values of a map are |a| + |b| and |a| - |b|. The second value is negative if the map mirrors
    the triangle. The nearest rotation is a / |a|.

    triangle_shapes, positions : (f, 3) corners of the triangles as complex numbers, before and after the map
    """
    e1, e2 = triangle_shapes[:, 1] - triangle_shapes[:, 0], triangle_shapes[:, 2] - triangle_shapes[:, 0]
    d1, d2 = positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]
    cross = e1 * np.conj(e2) - e2 * np.conj(e1)
    return (d1 * np.conj(e2) - d2 * np.conj(e1)) / cross, (e1 * d2 - e2 * d1) / cross


def singular_values(corners: NDArray[np.floating], uv: NDArray[np.floating]) -> Doubles:
    """Return the largest and smallest length in uv of 1 mm on the surface, per triangle, (f, 2) [1/mm].

    The smallest length is negative for triangles that are mirrored as seen from outside.

    corners : (f, 3, 3) positions of the corners [mm]
    uv : (f, 3, 2) uv of the corners, v down
    """
    positions = np.asarray(uv[..., 0] - 1j * uv[..., 1], dtype=np.complex128)
    a, b = affine_coefficients(planar_triangles(corners), positions)
    return np.column_stack((np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)))


def untangle(positions: Doubles, triangles: Index) -> Doubles:
    """Move inner points of a flat mesh until few or no triangles are mirrored; return positions (n, 2).

    Points around mirrored triangles are moved to the mean of their neighbours. Inside a convex outline, this
    mirrors no triangle [Tutte1963]. If triangles are still mirrored, more points around them are moved.
    Points of the border do not move.

    positions : (n, 2) points, x to the right, y up
    triangles : (f, 3) point indices
    """
    ends, _, counts = edges(triangles)
    inner = np.ones(len(positions), dtype=bool)
    inner[ends[counts != 2]] = False
    for rings in range(_MAX_UNTANGLED_RINGS):
        free = np.zeros(len(positions), dtype=bool)
        free[triangles[uv_cross(positions[triangles]) <= 0]] = True
        for _ in range(rings):
            free[triangles[free[triangles].any(axis=1)]] = True
        free &= inner
        if not free.any():
            break
        positions = _average_neighbours(positions, ends, free)
    return positions


def _average_neighbours(positions: Doubles, edge_points: Index, free_points: Mask) -> Doubles:
    """Place all free points at the mean of their neighbours; return positions (n, 2).

    positions : (n, 2) positions before the move
    edge_points : (e, 2) point indices of the edges
    free_points : (n,) mask of the points that may move
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import laplacian
    from scipy.sparse.linalg import spsolve

    n = len(positions)
    both = np.vstack((edge_points, edge_points[:, ::-1]))
    links = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    matrix: Any = laplacian(links)
    rows: Any = csr_array(matrix)[free_points]  # the format of `laplacian` is slow to index
    result = positions.copy()
    result[free_points] = spsolve(
        rows[:, free_points].tocsc(), -(rows[:, ~free_points] @ positions[~free_points])
    ).reshape(-1, 2)
    return result


def flatten(points: Doubles, triangles: Index, length_ratio: Doubles, stretch_weight: Doubles) -> Doubles:
    """Flatten a surface into the plane with little stretch; return positions (n, 2) [mm].

    The plane is seen from outside, x to the right and y up. Connected components are flattened together, each
    with its own origin.

    points : (n, 3) vertices [mm]
    triangles : (f, 3) vertex indices
    length_ratio : (f,) desired length in the plane per length on the surface [-]
    stretch_weight : (f,) weight of each triangle's stretch in the minimised sum [-]

    The initial map is a least squares conformal map [Levy2002] in the Hermitian form of [Mullen2008]. The map
    is then made as rigid as possible [Liu2008], with higher weights for strongly compressed triangles, as in
    [Rabinovich2017].
    """
    triangle_shapes = planar_triangles(points[triangles])
    vertex_component = vertex_components(triangles, len(points))
    z = _conformal_map(points, triangles, vertex_component, triangle_shapes)
    scaled = triangle_shapes * length_ratio[:, None]
    for _ in range(_REWEIGHTING_COUNT):
        a, b = affine_coefficients(scaled, z[triangles])
        z = _make_map_rigid(
            z,
            triangles,
            vertex_component,
            scaled,
            stretch_weight / length_ratio**2 * _stiffness_weights(a, b),
        )
    return untangle(np.column_stack((z.real, z.imag)), triangles)


def vertex_components(triangles: Index, vertex_count: int) -> Index:
    """Return the index of each vertex's connected component (n,)."""
    return label_components(vertex_count, triangles.ravel(), np.roll(triangles, -1, axis=1).ravel())


def _cotangents(triangle_shapes: Complexes) -> Doubles:
    """Return the cotangents (f, 3) of the angles opposite to the sides 01, 12 and 20."""
    apex = np.roll(triangle_shapes, -2, axis=1)
    product = np.conj(triangle_shapes - apex) * (np.roll(triangle_shapes, -1, axis=1) - apex)
    return np.asarray(product.real / np.maximum(np.abs(product.imag), 1e-9 * np.abs(product)))


def _laplacian(triangles: Index, weights: Doubles, vertex_count: int) -> Any:
    """Return the sparse (n, n) Laplacian of a mesh whose triangle sides have weights (f, 3)."""
    from scipy.sparse import coo_array

    start, end, weight = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel(), weights.ravel()
    rows, columns = np.concatenate((start, end, start, end)), np.concatenate((start, end, end, start))
    values = np.concatenate((weight, weight, -weight, -weight))
    return coo_array((values, (rows, columns)), shape=(vertex_count, vertex_count)).tocsc()


def _conformal_map(
    points: Doubles, triangles: Index, vertex_component: Index, triangle_shapes: Complexes
) -> Complexes:
    """Return the complex positions (n,) of a least squares conformal map, which changes angles least.

    Two points of each connected component are fixed.

    points : (n, 3) vertices [mm]
    triangles : (f, 3) vertex indices
    vertex_component : (n,) index of the connected component of each vertex
    triangle_shapes : (f, 3) shape of each triangle in the plane, as complex numbers
    """
    from scipy.sparse import coo_array

    n, start, end = len(points), triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    # twice the signed area of all triangles is a Hermitian form of the edges
    area = coo_array((np.full(len(start), 1j), (start, end)), shape=(n, n)).tocsc()
    energy = _laplacian(triangles, _cotangents(triangle_shapes), n) + area + area.conj().T
    low, high = _extreme_points(points, vertex_component)
    fixed = np.zeros(n, dtype=bool)
    fixed[low] = fixed[high] = True
    z = np.zeros(n, dtype=np.complex128)
    z[high] = np.linalg.norm(points[high] - points[low], axis=1)
    z[~fixed] = _sparse_solver(energy[~fixed][:, ~fixed])(-(energy[~fixed] @ z))
    return z


def _extreme_points(points: Doubles, vertex_component: Index) -> tuple[Index, Index]:
    """Return the first and last point (c,) of each component along x, y or z, whichever is its longest axis.

    vertex_component : (n,) index of the connected component of each vertex
    """
    count = int(vertex_component.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, vertex_component, points)
    np.maximum.at(high, vertex_component, points)
    axis = (high - low).argmax(axis=1)
    order = np.lexsort((points[np.arange(len(points)), axis[vertex_component]], vertex_component))
    last = np.append(vertex_component[order][1:] != vertex_component[order][:-1], True)
    return order[np.roll(last, 1)], order[last]


def _sparse_solver(matrix: Any) -> Any:
    """Return a function that solves linear systems with a symmetric or Hermitian sparse matrix."""
    from scipy.sparse.linalg import splu

    if matrix.shape[0] == 0:
        return lambda right: right
    symmetric = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric).solve


def _stiffness_weights(conformal_part: Complexes, mirrored_part: Complexes) -> Doubles:
    """Return weights (f,): 1 for unstretched triangles, larger for compressed and mirrored triangles.

    conformal_part, mirrored_part : (f,) coefficients of the affine maps, from `affine_coefficients`
    """
    total = np.zeros(len(conformal_part))
    for value in (
        np.abs(conformal_part) + np.abs(mirrored_part),
        np.abs(conformal_part) - np.abs(mirrored_part),
    ):
        sigma = np.clip(value, 0.2, 5.0)
        total += (1 + sigma) * (1 + sigma**2) / (8 * sigma**3)
    return total


def _make_map_rigid(
    positions: Complexes,
    triangles: Index,
    vertex_component: Index,
    triangle_shapes: Complexes,
    stretch_weight: Doubles,
) -> Complexes:
    """Make a flat map as rigid as possible [Liu2008]; return the positions (n,) as complex numbers.

    positions : (n,) positions before the first iteration, as complex numbers
    triangles : (f, 3) vertex indices
    vertex_component : (n,) index of the connected component of each vertex
    triangle_shapes : (f, 3) desired shape and size of the triangles
    stretch_weight : (f,) weight of each triangle's stretch in the minimised sum [-]
    """
    n, cot = len(positions), _cotangents(triangle_shapes) * stretch_weight[:, None]
    free = np.ones(n, dtype=bool)
    free[np.unique(vertex_component, return_index=True)[1]] = False
    solve = _sparse_solver(_laplacian(triangles, cot, n)[free][:, free])
    weighted_edges = cot * (np.roll(triangle_shapes, -1, axis=1) - triangle_shapes)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    for _ in range(_RIGID_ITERATION_COUNT):
        a, _ = affine_coefficients(triangle_shapes, positions[triangles])
        rotated = (weighted_edges * (a / np.maximum(np.abs(a), 1e-12))[:, None]).ravel()
        axes = rotated.real, rotated.imag
        right = [np.bincount(end, axis, n) - np.bincount(start, axis, n) for axis in axes]
        x, y = solve(np.column_stack(right)[free]).T
        positions = np.zeros(n, dtype=np.complex128)
        positions[free] = x + 1j * y
    return positions
