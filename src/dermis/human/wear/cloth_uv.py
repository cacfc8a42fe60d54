"""Coordinates along the threads of the cloth of a garment's body."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.wear.skin_sheet import Cut, point_normals, unit_vectors

_MIN_PROJECTED = 0.05  # lower limit of the length of the weft direction after projection onto the surface
_REGULARISATION = 1e-6


def cloth_coordinates_mm(part: Cut, mean_mm: Doubles) -> Doubles:
    """Return the coordinates (m, 2) of the points of a garment's body along weft and warp [mm].

    Their gradients are a least-squares fit to the directions of the threads on the surface: the weft runs
    from side to side, and the warp up the front and down the back.

    part : part of the skin sheet that the body covers
    mean_mm : (m, 3) points of this part on the mean person
    """
    from scipy.sparse import csr_array, diags_array, eye_array
    from scipy.sparse.linalg import factorized

    corners = mean_mm[part.triangles]
    a, b, c = corners.transpose(1, 0, 2)
    area_normal = np.cross(b - a, c - a)
    double_area = np.linalg.norm(area_normal, axis=1)
    kept = double_area > 1e-6
    triangles, double_area = part.triangles[kept], double_area[kept]
    a, b, c, normal = a[kept], b[kept], c[kept], area_normal[kept] / double_area[:, None]
    smooth = unit_vectors(point_normals(mean_mm, part.triangles)[triangles].mean(axis=1))
    weft = np.array([1.0, 0.0, 0.0]) - smooth[:, :1] * smooth
    weight = double_area * np.maximum(np.linalg.norm(weft, axis=1), _MIN_PROJECTED)
    weft = unit_vectors(weft)
    directions = weft, np.cross(smooth, weft)
    gradients = np.stack([np.cross(normal, edge) for edge in (c - b, a - c, b - a)], axis=1)
    gradients /= double_area[:, None, None]
    count, n = len(triangles), len(mean_mm)
    rows = np.repeat(np.arange(3 * count), 3)
    columns = np.repeat(triangles, 3, axis=0).reshape(-1)
    gradient = csr_array((gradients.transpose(0, 2, 1).ravel(), (rows, columns)), shape=(3 * count, n))
    weighted = gradient.T @ diags_array(np.repeat(weight, 3))
    solve = factorized((weighted @ gradient + _REGULARISATION * eye_array(n)).tocsc())
    return np.stack([solve(weighted @ direction.ravel()) for direction in directions], axis=1)
