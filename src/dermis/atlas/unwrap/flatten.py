"""Flattening of a chart: stretch of triangles, and untangling of flipped ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import edges, uv_cross

Doubles = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Index = NDArray[np.int64]
_RINGS = 5  # around mirrored triangles, of points that may move
_STIFFENINGS, _ROUNDS = 6, 8  # changes of the weights, and rounds after each


def flat_shapes(corners: NDArray[np.floating]) -> Complexes:
    """Corners (f, 3) of each triangle in a plane of its own, seen from outside, as complex numbers [mm].

    corners : (f, 3, 3) [mm]; the first one comes to 0 and the second onto the positive real axis
    """
    a, b, c = (np.asarray(corners[:, k], dtype=np.float64) for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    along = np.einsum("fi,fi->f", c - a, b - a) / length
    up = np.linalg.norm(np.cross(b - a, c - a), axis=1) / length
    return np.column_stack((np.zeros(len(a)), length, along + 1j * up))


def turning_and_shear(shapes: Complexes, places: Complexes) -> tuple[Complexes, Complexes]:
    """a and b of the map z -> a z + b conj(z) + c from each shape to its places, both (f, 3).

    |a| + |b| and |a| - |b| are the map's singular values, the latter negative where it turns the triangle
    over; a / |a| is the rotation nearest to it.
    """
    e1, e2 = shapes[:, 1] - shapes[:, 0], shapes[:, 2] - shapes[:, 0]
    d1, d2 = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    cross = e1 * np.conj(e2) - e2 * np.conj(e1)
    return (d1 * np.conj(e2) - d2 * np.conj(e1)) / cross, (e1 * d2 - e2 * d1) / cross


def singular_values(corners: NDArray[np.floating], uv: NDArray[np.floating]) -> Doubles:
    """Greatest and least length in uv of a mm on the surface (f, 2) [1/mm]; the least is signed.

    corners : (f, 3, 3) [mm]
    uv : (f, 3, 2) v down; triangles that are mirrored as seen from outside have a negative least value
    """
    places = np.asarray(uv[..., 0] - 1j * uv[..., 1], dtype=np.complex128)
    a, b = turning_and_shear(flat_shapes(corners), places)
    return np.column_stack((np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)))


def untangle(places: Doubles, triangles: Index) -> Doubles:
    """The places (n, 2) with few or no mirrored triangles.

    Points around these move to the mean of their neighbours, which mirrors no triangle within a convex
    outline [Tutte1963]; more and more points, until none is mirrored. The border stays.

    places : (n, 2) x to the right, y up
    triangles : (f, 3)
    """
    ends, _, counts = edges(triangles)
    inner = np.ones(len(places), dtype=bool)
    inner[ends[counts != 2]] = False
    for rings in range(_RINGS):
        free = np.zeros(len(places), dtype=bool)
        free[triangles[uv_cross(places[triangles]) <= 0]] = True
        for _ in range(rings):
            free[triangles[free[triangles].any(axis=1)]] = True
        free &= inner
        if not free.any():
            break
        places = _even(places, ends, free)
    return places


def _even(places: Doubles, ends: Index, free: NDArray[np.bool_]) -> Doubles:
    """The places with the free ones at the mean of their neighbours."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import laplacian
    from scipy.sparse.linalg import spsolve

    n = len(places)
    both = np.vstack((ends, ends[:, ::-1]))
    links = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    matrix: Any = laplacian(links)
    pull: Any = csr_array(matrix)[free]  # it comes in a form that is slow to index
    moved = places.copy()
    moved[free] = spsolve(pull[:, free].tocsc(), -(pull[:, ~free] @ places[~free])).reshape(-1, 2)
    return moved


def flatten(points: Doubles, triangles: Index, density: Doubles, weight: Doubles) -> Doubles:
    """Places (n, 2) in the plane, x to the right and y up as seen from outside [mm times density].

    Any number of separate sheets is laid flat at once, each about the origin of its own.

    points : (n, 3) [mm]
    triangles : (f, 3)
    density : (f,) wanted size in the plane relative to that in space [-]
    weight : (f,) how much the stretch of each triangle matters [-]

    Least squares conformal [Levy2002] in the Hermitian form of [Mullen2008], then as rigid as possible
    [Liu2008], triangles that are crushed weighing more as in [Rabinovich2017].
    """
    shapes = flat_shapes(points[triangles])
    sheet = sheets(triangles, len(points))
    z = _conformal(points, triangles, sheet, shapes)
    scaled = shapes * density[:, None]
    for _ in range(_STIFFENINGS):
        a, b = turning_and_shear(scaled, z[triangles])
        z = _stiffen(z, triangles, sheet, scaled, weight / density**2 * _stiffness(a, b))
    return untangle(np.column_stack((z.real, z.imag)), triangles)


def sheets(triangles: Index, n: int) -> Index:
    """Number of the sheet of each vertex (n,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    links = coo_array((np.ones(len(start)), (start, end)), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _cotangents(shapes: Complexes) -> Doubles:
    """Cotangents of the angles opposite the sides 01, 12, 20 (f, 3)."""
    apex = np.roll(shapes, -2, axis=1)
    product = np.conj(shapes - apex) * (np.roll(shapes, -1, axis=1) - apex)
    return np.asarray(product.real / np.maximum(np.abs(product.imag), 1e-9 * np.abs(product)))


def _matrix(triangles: Index, weights: Doubles, n: int) -> Any:
    """The Laplacian (n, n) with weights (f, 3) on the sides."""
    from scipy.sparse import coo_array

    start, end, weight = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel(), weights.ravel()
    rows, columns = np.concatenate((start, end, start, end)), np.concatenate((start, end, end, start))
    values = np.concatenate((weight, weight, -weight, -weight))
    return coo_array((values, (rows, columns)), shape=(n, n)).tocsc()


def _conformal(points: Doubles, triangles: Index, sheet: Index, shapes: Complexes) -> Complexes:
    """The places (n,) with the least change of angles; two points of each sheet hold its size."""
    from scipy.sparse import coo_array

    n, start, end = len(points), triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    # twice the signed area of all triangles is the Hermitian form of their sides' directions
    turn = coo_array((np.full(len(start), 1j), (start, end)), shape=(n, n)).tocsc()
    energy = _matrix(triangles, _cotangents(shapes), n) + turn + turn.conj().T
    low, high = _far_points(points, sheet)
    held = np.zeros(n, dtype=bool)
    held[low] = held[high] = True
    z = np.zeros(n, dtype=np.complex128)
    z[high] = np.linalg.norm(points[high] - points[low], axis=1)
    z[~held] = _factor(energy[~held][:, ~held])(-(energy[~held] @ z))
    return z


def _far_points(points: Doubles, sheet: Index) -> tuple[Index, Index]:
    """Two points (c,) of each sheet, at the ends of the axis along which it is longest."""
    count = int(sheet.max()) + 1
    least, most = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(least, sheet, points)
    np.maximum.at(most, sheet, points)
    axis = (most - least).argmax(axis=1)
    order = np.lexsort((points[np.arange(len(points)), axis[sheet]], sheet))
    last = np.append(sheet[order][1:] != sheet[order][:-1], True)
    return order[np.roll(last, 1)], order[last]


def _factor(matrix: Any) -> Any:
    """A solver for a symmetric or Hermitian matrix."""
    from scipy.sparse.linalg import splu

    if matrix.shape[0] == 0:
        return lambda right: right
    symmetric = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric).solve


def _stiffness(a: Complexes, b: Complexes) -> Doubles:
    """Weight (f,) that makes crushed and mirrored triangles stiff, 1 without stretch."""
    total = np.zeros(len(a))
    for value in (np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)):
        sigma = np.clip(value, 0.2, 5.0)
        total += (1 + sigma) * (1 + sigma**2) / (8 * sigma**3)
    return total


def _stiffen(z: Complexes, triangles: Index, sheet: Index, shapes: Complexes, weight: Doubles) -> Complexes:
    """The places with each triangle as nearly its own size and shape as the others allow."""
    n, cot = len(z), _cotangents(shapes) * weight[:, None]
    free = np.ones(n, dtype=bool)
    free[np.unique(sheet, return_index=True)[1]] = False
    solve = _factor(_matrix(triangles, cot, n)[free][:, free])
    pull = cot * (np.roll(shapes, -1, axis=1) - shapes)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    for _ in range(_ROUNDS):
        a, _ = turning_and_shear(shapes, z[triangles])
        turned = (pull * (a / np.maximum(np.abs(a), 1e-12))[:, None]).ravel()
        parts = turned.real, turned.imag
        force = [np.bincount(end, part, n) - np.bincount(start, part, n) for part in parts]
        x, y = solve(np.column_stack(force)[free]).T
        z = np.zeros(n, dtype=np.complex128)
        z[free] = x + 1j * y
    return z
