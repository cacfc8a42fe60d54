"""Flattening of charts with little stretch, and removal of mirrored triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import components, edges, uv_cross

Complexes = NDArray[np.complex128]
_MAX_RINGS = 5  # of triangles around mirrored ones whose points may move
_REWEIGHTINGS, _ITERATIONS = 6, 8  # changes of the weights, and iterations after each


def planar_triangles(corners: NDArray[np.floating]) -> Complexes:
    """Return the corners (f, 3) of each triangle in its own plane, as complex numbers [mm].

    The first corner is at 0 and the second on the positive real axis, as seen from outside.

    corners : (f, 3, 3) [mm]
    """
    a, b, c = (np.asarray(corners[:, k], dtype=np.float64) for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    along = np.einsum("fi,fi->f", c - a, b - a) / length
    up = np.linalg.norm(np.cross(b - a, c - a), axis=1) / length
    return np.column_stack((np.zeros(len(a)), length, along + 1j * up))


def affine_coefficients(shapes: Complexes, positions: Complexes) -> tuple[Complexes, Complexes]:
    """Return a and b (f,) of the maps z -> a z + b conj(z) + c that take `shapes` to `positions`.

    |a| + |b| and |a| - |b| are the map's singular values, the latter negative where it mirrors the triangle;
    a / |a| is the nearest rotation.

    shapes, positions : (f, 3) corners of the triangles
    """
    e1, e2 = shapes[:, 1] - shapes[:, 0], shapes[:, 2] - shapes[:, 0]
    d1, d2 = positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]
    cross = e1 * np.conj(e2) - e2 * np.conj(e1)
    return (d1 * np.conj(e2) - d2 * np.conj(e1)) / cross, (e1 * d2 - e2 * d1) / cross


def singular_values(corners: NDArray[np.floating], uv: NDArray[np.floating]) -> Doubles:
    """Return the largest and smallest length in uv of 1 mm on the surface (f, 2) [1/mm].

    The smallest value is negative for triangles that are mirrored as seen from outside.

    corners : (f, 3, 3) [mm]
    uv : (f, 3, 2), v down
    """
    positions = np.asarray(uv[..., 0] - 1j * uv[..., 1], dtype=np.complex128)
    a, b = affine_coefficients(planar_triangles(corners), positions)
    return np.column_stack((np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)))


def untangle(positions: Doubles, triangles: Index) -> Doubles:
    """Return positions (n, 2) with few or no mirrored triangles; the border is unchanged.

    Points around mirrored triangles are moved to the mean of their neighbours, which mirrors no triangle
    within a convex outline [Tutte1963]. More and more points are moved until no triangle is mirrored.

    positions : (n, 2) x to the right, y up
    triangles : (f, 3)
    """
    ends, _, counts = edges(triangles)
    inner = np.ones(len(positions), dtype=bool)
    inner[ends[counts != 2]] = False
    for rings in range(_MAX_RINGS):
        free = np.zeros(len(positions), dtype=bool)
        free[triangles[uv_cross(positions[triangles]) <= 0]] = True
        for _ in range(rings):
            free[triangles[free[triangles].any(axis=1)]] = True
        free &= inner
        if not free.any():
            break
        positions = _average_neighbours(positions, ends, free)
    return positions


def _average_neighbours(positions: Doubles, ends: Index, free: Mask) -> Doubles:
    """Return the positions with each free point at the mean of its neighbours."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import laplacian
    from scipy.sparse.linalg import spsolve

    n = len(positions)
    both = np.vstack((ends, ends[:, ::-1]))
    links = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    matrix: Any = laplacian(links)
    rows: Any = csr_array(matrix)[free]  # the format of `laplacian` is slow to index
    result = positions.copy()
    result[free] = spsolve(rows[:, free].tocsc(), -(rows[:, ~free] @ positions[~free])).reshape(-1, 2)
    return result


def flatten(points: Doubles, triangles: Index, density: Doubles, weight: Doubles) -> Doubles:
    """Return the positions (n, 2) of a surface flattened to the plane [mm times density].

    They are as seen from outside, x to the right and y up. Separate connected components are flattened
    together, each with an origin of its own.

    points : (n, 3) [mm]
    triangles : (f, 3)
    density : (f,) desired size in the plane relative to that in space [-]
    weight : (f,) importance of each triangle's stretch [-]

    The start is a least squares conformal map [Levy2002] in the Hermitian form of [Mullen2008]. It is then
    made as rigid as possible [Liu2008], with higher weights for strongly compressed triangles as in
    [Rabinovich2017].
    """
    shapes = planar_triangles(points[triangles])
    component = vertex_components(triangles, len(points))
    z = _conformal_map(points, triangles, component, shapes)
    scaled = shapes * density[:, None]
    for _ in range(_REWEIGHTINGS):
        a, b = affine_coefficients(scaled, z[triangles])
        z = _rigid_step(z, triangles, component, scaled, weight / density**2 * _stiffness(a, b))
    return untangle(np.column_stack((z.real, z.imag)), triangles)


def vertex_components(triangles: Index, n: int) -> Index:
    """Return the connected component of each vertex (n,)."""
    return components(n, triangles.ravel(), np.roll(triangles, -1, axis=1).ravel())


def _cotangents(shapes: Complexes) -> Doubles:
    """Return the cotangents of the angles opposite the sides 01, 12, 20 (f, 3)."""
    apex = np.roll(shapes, -2, axis=1)
    product = np.conj(shapes - apex) * (np.roll(shapes, -1, axis=1) - apex)
    return np.asarray(product.real / np.maximum(np.abs(product.imag), 1e-9 * np.abs(product)))


def _laplacian(triangles: Index, weights: Doubles, n: int) -> Any:
    """Return the (n, n) Laplacian with weights (f, 3) on the sides."""
    from scipy.sparse import coo_array

    start, end, weight = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel(), weights.ravel()
    rows, columns = np.concatenate((start, end, start, end)), np.concatenate((start, end, end, start))
    values = np.concatenate((weight, weight, -weight, -weight))
    return coo_array((values, (rows, columns)), shape=(n, n)).tocsc()


def _conformal_map(points: Doubles, triangles: Index, component: Index, shapes: Complexes) -> Complexes:
    """Return the positions (n,) with the least change of angles; two points of each component are fixed."""
    from scipy.sparse import coo_array

    n, start, end = len(points), triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    # twice the signed area of all triangles is a Hermitian form of the edges
    area = coo_array((np.full(len(start), 1j), (start, end)), shape=(n, n)).tocsc()
    energy = _laplacian(triangles, _cotangents(shapes), n) + area + area.conj().T
    low, high = _extreme_points(points, component)
    fixed = np.zeros(n, dtype=bool)
    fixed[low] = fixed[high] = True
    z = np.zeros(n, dtype=np.complex128)
    z[high] = np.linalg.norm(points[high] - points[low], axis=1)
    z[~fixed] = _factorise(energy[~fixed][:, ~fixed])(-(energy[~fixed] @ z))
    return z


def _extreme_points(points: Doubles, component: Index) -> tuple[Index, Index]:
    """Return two points (c,) of each component, at the ends of the axis along which it is longest."""
    count = int(component.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, component, points)
    np.maximum.at(high, component, points)
    axis = (high - low).argmax(axis=1)
    order = np.lexsort((points[np.arange(len(points)), axis[component]], component))
    last = np.append(component[order][1:] != component[order][:-1], True)
    return order[np.roll(last, 1)], order[last]


def _factorise(matrix: Any) -> Any:
    """Return a solver for a symmetric or Hermitian matrix."""
    from scipy.sparse.linalg import splu

    if matrix.shape[0] == 0:
        return lambda right: right
    symmetric = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric).solve


def _stiffness(a: Complexes, b: Complexes) -> Doubles:
    """Return weights (f,) that are 1 without stretch and larger for compressed and mirrored triangles."""
    total = np.zeros(len(a))
    for value in (np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)):
        sigma = np.clip(value, 0.2, 5.0)
        total += (1 + sigma) * (1 + sigma**2) / (8 * sigma**3)
    return total


def _rigid_step(
    z: Complexes, triangles: Index, component: Index, shapes: Complexes, weight: Doubles
) -> Complexes:
    """Return the positions after some iterations towards each triangle's own size and shape."""
    n, cot = len(z), _cotangents(shapes) * weight[:, None]
    free = np.ones(n, dtype=bool)
    free[np.unique(component, return_index=True)[1]] = False
    solve = _factorise(_laplacian(triangles, cot, n)[free][:, free])
    weighted_edges = cot * (np.roll(shapes, -1, axis=1) - shapes)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    for _ in range(_ITERATIONS):
        a, _ = affine_coefficients(shapes, z[triangles])
        rotated = (weighted_edges * (a / np.maximum(np.abs(a), 1e-12))[:, None]).ravel()
        axes = rotated.real, rotated.imag
        right = [np.bincount(end, axis, n) - np.bincount(start, axis, n) for axis in axes]
        x, y = solve(np.column_stack(right)[free]).T
        z = np.zeros(n, dtype=np.complex128)
        z[free] = x + 1j * y
    return z
