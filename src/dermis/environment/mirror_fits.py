"""Round lobes in the plane of view that stand for a surface's, by least squares over a sky's spectrum."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from dermis.environment.harmonics import legendre
from dermis.environment.prefilter import ROUGHEST, ROUGHNESSES, SMOOTHEST, mirror_kernel
from dermis.optics.fits.variable_projection import triangle
from dermis.specular.cosines import cosines
from dermis.specular.models import Lobe

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Node = tuple[int, int]
ROUGH, VIEWS, LOBES = 12, 16, 4
MIRROR_ROUGHNESSES = np.geomspace(0.05, 1.0, ROUGH)
"""Of the table's rows."""
MIRROR_VIEWS = np.maximum(np.linspace(0.0, 1.0, VIEWS) ** 2, 0.02)
"""Cosines of the table's columns; the first stand for 0."""
_DEGREE = 96
_POWER = 2.0  # by which a sky's power per harmonic falls with the degree; 0.6 and 2.7 of the samples
_FIRST = 10.0  # times the weight of degree 1, so that the sum has the lobe's mean direction
_NODES = (160, 40)  # of the sum over a lobe, along the plane of view and across
_PASSES = 2
_HELD = 0.02  # keeps lobes near the mean of their neighbours', where light leaves them undetermined
_STEPS = 30
_FURTHEST = 5.0  # in widths of the lobe from its middle, and for logarithms of weights
_START = np.repeat([0.0, -0.5, 0.0], LOBES) + np.concatenate([np.linspace(-1.0, 1.0, LOBES), np.zeros(8)])


class Target(NamedTuple):
    """A lobe for one roughness and view, with light of 1 in all.

    coefficients : (n,) of its harmonics about the normal of the plane of view
    middle : angle of its mean direction from the surface's normal [rad]
    along, across : standard deviations along the plane [rad] and of the sine across it
    """

    coefficients: Complex
    middle: float
    along: float
    across: float


def fitted_mirrors(lobe: Lobe) -> Floats:
    """(12, 16, 4, 3) angle [rad], roughness and weight of round lobes, by the table's roughness and view.

    The four lie in the plane of view, at angles from the normal, away from the eye. Their sum differs least
    from the surface's lobe under skies whose power falls with the degree of harmonics: what a picture would
    show of the difference is made small, light from below the horizon as well. Fits go from rough and grazing
    to smooth and steep, each from its neighbours', so that lobes keep their places and change evenly
    between the nodes.
    """
    found: dict[Node, Floats] = {}
    targets = {
        (i, j): _target(lobe, float(MIRROR_VIEWS[j]), float(MIRROR_ROUGHNESSES[i])) for i, j in _nodes()
    }
    for _ in range(_PASSES):
        for i, j in _nodes():
            near = [found[at] for at in ((i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)) if at in found]
            middle = np.mean(near, axis=0) if near else _START
            start = found.get((i, j), np.asarray(middle))
            if j == VIEWS - 1:
                start, middle = _even(start), _even(middle)  # and so is what the fit gives
            found[i, j] = _fit(targets[i, j], start, middle)
    table = np.empty((ROUGH, VIEWS, LOBES, 3))
    for at in _nodes():
        angle, rough, weight = _lobes(found[at], targets[at])
        table[at] = np.stack([angle, np.exp(rough), weight], axis=-1)
    return table


def _nodes() -> Iterator[Node]:
    return ((i, j) for i in reversed(range(ROUGH)) for j in range(VIEWS))


@cache
def _terms() -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """(n,) degrees, orders and weights of the harmonics that are alike on both sides of the plane."""
    pairs = [(l, m) for m in range(_DEGREE + 1) for l in range(m, _DEGREE + 1, 2)]
    degree, order = np.array(pairs, np.intp).T
    weight = np.sqrt(4.0 * np.pi * (degree + 1.0) ** -_POWER * np.where(order > 0, 2.0, 1.0))
    weight[degree == 1] *= _FIRST
    return degree, order, weight


def _functions(sine: Floats) -> Floats:
    """(n, k) Legendre functions of the terms at sines of the angle from the plane (k,)."""
    return np.concatenate([rows[::2] for rows in legendre(sine, _DEGREE, _DEGREE + 1)])


@cache
def _across(m: float) -> tuple[Floats, Floats, Floats]:
    """Angles from the plane, denser near it, their steps and functions."""
    t = (np.arange(_NODES[1]) + 0.5) / _NODES[1]
    widest = min(10.0 * m + 0.05, 0.5 * np.pi)
    return widest * t**2, 2.0 * widest * t / _NODES[1], _functions(np.sin(widest * t**2))


def _target(lobe: Lobe, cosine: float, m: float) -> Target:
    """The sum over one side of the plane; the other is alike."""
    beside, steps, functions = _across(m)
    mirror, reach = np.arccos(cosine), 12.0 * m + 0.1
    low, high = max(mirror - reach, -0.5 * np.pi), min(mirror + reach, 0.5 * np.pi)
    angles = low + (high - low) * (np.arange(_NODES[0]) + 0.5) / _NODES[0]
    a, y = np.meshgrid(angles, beside, indexing="ij")
    light = np.stack([np.sin(a) * np.cos(y), np.sin(y), np.cos(a) * np.cos(y)], axis=-1)
    view = np.array([-np.sqrt(1.0 - cosine**2), 0.0, cosine])
    with np.errstate(under="ignore"):
        weight = lobe(cosines(np.array([0.0, 0.0, 1.0]), light, view), m) * light[..., 2] * np.cos(y) * steps
    weight = weight / weight.sum()
    around = np.exp(-1j * np.outer(np.arange(_DEGREE + 1), angles)) @ weight
    middle = np.arctan2((weight * light[..., 0]).sum(), (weight * light[..., 2]).sum())
    along, across = (float(np.sqrt((weight * x**2).sum())) for x in (a - middle, light[..., 1]))
    _, order, _ = _terms()
    return Target((around[order] * functions).sum(axis=1), float(middle), along, across)


def _fit(target: Target, start: Floats, near: Floats) -> Floats:
    """(12,) places, widths and weights, relative to the lobe's.

    near : the mean of the neighbours'
    """
    _, _, scale = _terms()
    held = _HELD * np.repeat([1.0, 1.0, 0.5], LOBES)
    low, high = np.full(3 * LOBES, -_FURTHEST), np.full(3 * LOBES, _FURTHEST)
    smooth, rough = np.log([SMOOTHEST, ROUGHEST]) - np.log(target.across)
    low[LOBES : 2 * LOBES], high[LOBES : 2 * LOBES] = smooth, max(rough, smooth + 0.1)

    @lru_cache(maxsize=2)
    def reduced(vector: bytes) -> Floats:
        """Slopes and residuals as one triangle: the same lengths and angles in 13 rows instead of 5,000."""
        at = np.frombuffer(vector)
        mixed, by = _mixed(at, target)
        off, slopes = (mixed - target.coefficients) * scale, by * scale[:, None]
        tall = np.column_stack([np.vstack([slopes, np.diag(held)]), np.append(off, held * (at - near))])
        return triangle(np.vstack([tall.real, tall.imag]))

    def residual(vector: Floats) -> Floats:
        return reduced(vector.tobytes())[:, -1]

    def slopes(vector: Floats) -> Floats:
        return reduced(vector.tobytes())[:, :-1]

    inside = np.clip(start, low + 1e-4, high - 1e-4)
    done = least_squares(
        residual, inside, jac=slopes, bounds=(low, high), max_nfev=_STEPS, ftol=1e-4, xtol=1e-5
    )
    return np.asarray(done.x)


def _even(vector: Floats) -> Floats:
    """The same on both sides of the normal, as a lobe is that is seen along it."""
    place, wide, share = vector.reshape(3, LOBES)
    return 0.5 * np.concatenate([place - place[::-1], wide + wide[::-1], share + share[::-1]])


def _lobes(vector: Floats, target: Target) -> tuple[Floats, Floats, Floats]:
    """Angles, logarithms of roughnesses, weights with the sum 1."""
    place, wide, share = vector.reshape(3, LOBES)
    weight = np.exp(share - share.max())
    return target.middle + place * target.along, np.log(target.across) + wide, weight / weight.sum()


def _mixed(vector: Floats, target: Target) -> tuple[Complex, Complex]:
    """(n,) coefficients of the sum of round lobes, and (n, 12) their derivatives."""
    _, order, _ = _terms()
    angle, rough, weight = _lobes(vector, target)
    turned = _in_plane()[:, None] * np.exp(-1j * np.outer(order, angle))
    factors, slopes = np.stack([_blurred(float(m)) for m in rough], axis=-1)
    each = factors * turned
    shares = each * weight
    total = shares.sum(axis=1)  # for a product BLAS would start threads, which wait longer than they work
    by_place = -1j * target.along * order[:, None] * shares
    return total, np.concatenate(
        [by_place, slopes * turned * weight, weight * (each - total[:, None])], axis=1
    )


@cache
def _in_plane() -> Floats:
    """(n,) functions in the plane itself."""
    return np.asarray(_functions(np.zeros(1))[:, 0])


def _blurred(rough: float) -> Floats:
    """(2, n) factors of the terms under a round lobe as the shader reads it, and their slopes by `rough`.

    rough : logarithm of the roughness; between two layers the shader mixes both
    """
    layers, degree = np.log(ROUGHNESSES), _terms()[0]
    step = layers[1] - layers[0]
    place = np.clip((rough - layers[0]) / step, 0.0, len(layers) - 1.0)
    low = min(int(place), len(layers) - 2)
    near, far = _kernels()[low : low + 2, degree]
    return np.stack([near + (place - low) * (far - near), (far - near) / step])


@cache
def _kernels() -> Floats:
    """(layers, degrees) factors of the layers."""
    return np.stack([mirror_kernel(float(m))[: _DEGREE + 1] for m in ROUGHNESSES])
