"""Dots scattered over a surface in space."""

from __future__ import annotations

import math

import numpy as np

from dermis.human.skin_maps.kernels.noise import share, word_at
from dermis.human.skin_maps.patch import Doubles
from dermis.machine_code import compiled


@compiled
def dots(
    x: float,
    y: float,
    z: float,
    normal: Doubles,
    spacing_mm: float,
    smallest: float,
    largest: float,
    kept: float,
    texel_mm: float,
    seed: int,
) -> float:
    """Round soft dots, 1 at the middle of one.

    x, y, z : place [mm]
    normal : (3,) unit normal of the surface there
    spacing_mm : of the dots, if all were kept [mm]
    smallest, largest : radius of the dots, up to 0.5 [of the spacing]
    kept : share of them that is shown, some of them faintly [-]
    texel_mm : a dot is as wide as texels need, and fainter by as much [mm]

    Source: [Worley1996] for points in the cells of a lattice.
    """
    x, y, z = x / spacing_mm, y / spacing_mm, z / spacing_mm
    blur = (1.2 * texel_mm / spacing_mm) ** 2
    first_i, first_j, first_k = math.floor(x - 0.5), math.floor(y - 0.5), math.floor(z - 0.5)
    total = 0.0
    for i in range(first_i, first_i + 2):
        for j in range(first_j, first_j + 2):
            for k in range(first_k, first_k + 2):
                word = word_at(i, j, k, seed)
                dx, dy, dz = x - i - share(word, 0), y - j - share(word, 1), z - k - share(word, 2)
                away = dx * dx + dy * dy + dz * dz
                if away < 0.25:
                    off = dx * normal[0] + dy * normal[1] + dz * normal[2]
                    other = word_at(i, j, k, seed + 1)
                    total += _dot(away, off, other, smallest, largest, kept, blur)
    return min(total, 1.0)


@compiled
def _dot(
    away: float, off: float, word: np.uint64, smallest: float, largest: float, kept: float, blur: float
) -> float:
    """One dot, from the squared distance to its middle and the distance along the normal [of the spacing].

    It is round in the surface, and fades with its middle's distance from the surface.
    """
    shown = min(max(4.0 * (kept - share(word, 0)) + kept, 0.0), 1.0)
    radius = smallest + (largest - smallest) * share(word, 1) ** 2
    reach = min(radius * radius + blur, 0.25)
    beside = max(1.0 - (away - off * off) / reach, 0.0)
    near = 1.0 - 4.0 * away
    return shown * near * near * beside * beside * beside * radius * radius / reach
