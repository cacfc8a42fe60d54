"""The large masses of the head: cranium, and the face with its jaw as a stack of rounded sections."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.fields import Doubles, rise, smooth_intersection, smooth_union
from dermis.human.bust.parameters import BustParameters

# Artist's values, made to agree with the measures of `anatomy`. Rows: height y, half-width, depth of the
# midline without nose and lips, depth at which the section is widest, roundness of its corners, and extent
# behind there.
SECTIONS = np.array(
    [
        [60, 62, 84.0, -8, 2.3, 66],
        [38, 65, 91.5, -5, 2.35, 66],
        [20, 66.5, 93.5, 0, 2.35, 66],
        [6, 67, 88.5, 2, 2.35, 64],
        [-10, 67.5, 87.5, 3, 2.3, 62],
        [-25, 66.5, 89.5, 4, 2.22, 56],
        [-46, 63.5, 94.5, 6, 2.1, 44],
        [-60, 60.5, 96.5, 7, 2.03, 34],
        [-68, 58.5, 96.3, 7, 2.0, 29],
        [-77, 56, 94.2, 7, 1.98, 25],
        [-85, 53.5, 91.0, 8, 1.97, 22],
        [-97, 49.5, 91.2, 8, 1.96, 20],
        [-105, 46, 90.5, 8, 1.96, 18],
        [-114, 41, 87.0, 8, 1.96, 16],
        [-130, 37, 81.0, 8, 2.0, 14],
    ]
)
_MENTON_Y, _JAW_SLOPE = -115.5, 0.36


def head(p: Doubles, parameters: BustParameters) -> Doubles:
    """Cranium and face as one mass, without features."""
    return smooth_union(cranium(p), face(p, parameters), 22)


def cranium(p: Doubles) -> Doubles:
    """The braincase: an egg, narrow at the forehead."""
    x, y, z = p[:, 0], p[:, 1] - 30, p[:, 2] + 8
    x = x / (1 - 0.2 * rise(z, -25, 100))
    ry = np.where(y > 0, 84.0, 78.0)
    rz = np.where(z > 0, 99.0, 89.0)
    return _radial((x / 75.0, y / ry, z / rz), (x, y, z), np.full(len(p), 2.32))


def face(p: Doubles, parameters: BustParameters) -> Doubles:
    """Face and jaw, closed below along the edge of the mandible, which rises to the ear."""
    from scipy.interpolate import CubicSpline

    x, y, z = p.T
    rising = _JAW_SLOPE * rise(y, -20, -90)
    level = np.clip(y + rising * np.minimum(z - 86, 0), -130, 60)
    half_width, front, widest, roundness, back = CubicSpline(SECTIONS[::-1, 0], SECTIONS[::-1, 1:])(level).T
    half_width = half_width * (1 + (parameters.jaw - 1) * rise(level, -20, -80))
    dz = z - widest
    depth = np.where(dz > 0, front - widest, back)
    sides = _radial((x / half_width, dz / depth), (x, dz), roundness)
    top = y - 62
    return smooth_intersection(smooth_intersection(sides, _MENTON_Y - level, 26), top, 45)


def _radial(scaled: tuple[Doubles, ...], local: tuple[Doubles, ...], power: Doubles) -> Doubles:
    """Distance along the ray from the centre to the superellipse where the powers of `scaled` sum to 1."""
    with np.errstate(divide="ignore"):
        logs = [power * np.log(np.abs(axis) + 1e-12) for axis in scaled]
    reach = np.sum([np.exp(log) for log in logs], axis=0) ** (1 / power)
    length = np.sqrt(np.sum([axis * axis for axis in local], axis=0))
    return np.asarray(length * (1 - 1 / np.maximum(reach, 1e-3)))
