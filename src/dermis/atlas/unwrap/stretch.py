"""How laying a triangle flat stretches it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Complexes = NDArray[np.complex128]


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
