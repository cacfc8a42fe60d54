"""The large masses of the head: cranium, and the face with its jaw as a stack of rounded sections."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.fields import Doubles, rise, smooth_intersection, smooth_union
from dermis.human.bust.parameters import BustParameters
from dermis.tables import numbers, read_rows

SECTIONS = numbers(read_rows(__package__, "sections"), "y half_width front widest roundness back")
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
