"""Spheres through points, and the cornea that stands out of one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

_STEPS = 12
_BULGE, _CORNEA = 0.025, 0.045
"""Of the radius: what stands out more is no roundness of the ball, and how far a cornea does at least."""
_WIDE = 0.7  # cosine of the angle from its axis within which a cornea lies
_MISSED = 0.85  # of the area, that is nearer to the sphere than its `miss`


class Sphere(NamedTuple):
    """A sphere that points lie on.

    middle : (3,) [mm]
    radius : [mm]
    miss : how far most of them lie off it, as a share of the radius [-]
    """

    middle: Doubles
    radius: float
    miss: float


def fit_sphere(points: Doubles, area: Doubles) -> Sphere:
    """The sphere that most of a surface lies on; what stands out of it, as a cornea does, counts little.

    points : (n, 3) [mm]
    area : (n,) of the surface around each [mm2]

    Weighted least squares of |p|^2 = 2 p.c + (r^2 - |c|^2), again and again with Cauchy's weights.
    """
    weight, share = np.ones(len(points)), area / area.sum()
    start = points.mean(axis=0)
    p = points - start
    for _ in range(_STEPS):
        root = np.sqrt(weight * share)[:, None]
        rows = np.column_stack((2 * p, np.ones(len(p))))
        found = np.linalg.lstsq(rows * root, (p * p).sum(axis=1) * root[:, 0], rcond=None)[0]
        radius = float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))
        off = np.abs(np.linalg.norm(p - found[:3], axis=1) - radius)
        order = np.argsort(off)
        at = np.cumsum(share[order])
        middle, most = (float(off[order][min(np.searchsorted(at, s), len(at) - 1)]) for s in (0.5, _MISSED))
        weight = 1.0 / (1.0 + (off / max(2.0 * middle, 1e-3 * radius, 1e-9)) ** 2)
    return Sphere(start + found[:3], radius, most / max(radius, 1e-9))


def corneal_axis(points: Doubles, area: Doubles, ball: Sphere, ahead: Doubles) -> Doubles | None:
    """(3,) the way that a cornea on a ball looks; None where nothing stands out like one.

    points, area : of all of the eye, see `fit_sphere`
    ahead : (3,) unit vector, about where the head looks
    """
    out = points - ball.middle
    far = np.linalg.norm(out, axis=1)
    height = far / ball.radius - 1.0
    stands = (height > _BULGE) & (out @ ahead > 0.3 * far)
    if not stands.any() or height[stands].max() < _CORNEA:
        return None
    share = (area * height)[stands]
    mean = _unit((share[:, None] * out[stands]).sum(axis=0))
    if share[out[stands] @ mean < _WIDE * far[stands]].sum() > 0.1 * share.sum():
        return None
    if np.count_nonzero(stands) < 8:
        return mean
    axis = _unit(fit_sphere(points[stands], area[stands]).middle - ball.middle)
    return axis if axis @ mean > 0.95 else mean


def _unit(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))
