"""Round lobes in the plane of view and beside it that stand for a surface's, by least squares over skies."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from dermis.environment.lobe_harmonics import RoundLobes, Target, lobe_target, round_sum, terms
from dermis.environment.prefilter import ROUGHEST, SMOOTHEST
from dermis.optics.fits.variable_projection import triangle
from dermis.specular.models import Lobe

Floats = NDArray[np.float64]
Node = tuple[int, int]
ROUGH, VIEWS, LOBES = 12, 16, 5
MIRROR_ROUGHNESSES = np.geomspace(0.05, 1.0, ROUGH)
"""Of the table's rows."""
MIRROR_VIEWS = np.maximum(np.linspace(0.0, 1.0, VIEWS) ** 2, 0.02)
"""Cosines of the table's columns; the first stand for 0."""
_IN_PLANE = (3,) * 10 + (2,) * 3 + (1,) * 3
"""By column: lobes that lie in the plane whatever the roughness, beside the pair."""
_LONG = 1.8  # times as long as wide: from here on the pair lies in the plane too, one behind the other
_PASSES = 2
_HELD = 0.01  # keeps lobes near the mean of their neighbours', where light leaves them undetermined
_STEPS = 30
_FURTHEST = 5.0  # in widths of the lobe from its middle, and for logarithms of weights
_SPLIT = 0.4  # of a pair that comes into the plane, from where it was
_PLACE, _BESIDE, _WIDE, _SHARE = range(4)
_START = np.array(
    [[-1.0, 1.0, -0.3, 0.3, 0.3], [0.0, 0.0, 0.0, 0.8, -0.8], [-0.3, -1.0, -0.5, -0.7, -0.7], [0.0] * LOBES]
)


def fitted_mirrors(lobe: Lobe) -> Floats:
    """(12, 16, 5, 4) angle, angle beside the plane of view [rad], roughness, weight, by the table's nodes.

    Angles are from the normal, away from the eye. Three lobes lie in the plane of view; of these steep
    views have two or one, and the others no weight. Two are a pair: to the left and right of the plane, or
    both in it where the surface's lobe is long. Their sum differs least from it under skies whose power
    falls with the degree of harmonics: what a picture would show of the difference is made small, light
    from below the horizon as well. Fits go from rough and grazing to smooth and steep, each from its
    neighbours', so that lobes keep their places and change evenly between the nodes.
    """
    found: dict[Node, Floats] = {}
    targets = {
        (i, j): lobe_target(lobe, float(MIRROR_VIEWS[j]), float(MIRROR_ROUGHNESSES[i])) for i, j in _nodes()
    }
    for _ in range(_PASSES):
        for i, j in _nodes():
            near = [found[at] for at in ((i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)) if at in found]
            middle = np.mean(near, axis=0) if near else _START
            found[i, j] = _fit(targets[i, j], j, found.get((i, j), middle), middle)
    table = np.empty((ROUGH, VIEWS, LOBES, 4))
    for i, j in _nodes():
        made = _lobes(found[i, j], targets[i, j], _kept(j))
        table[i, j] = np.stack([made.angle, made.beside, np.exp(made.rough), made.weight], axis=-1)
    return table


def _nodes() -> Iterator[Node]:
    return ((i, j) for i in reversed(range(ROUGH)) for j in range(VIEWS))


def _kept(column: int) -> NDArray[np.bool_]:
    """(5,) which lobes there are."""
    return np.array([k < _IN_PLANE[column] or k >= LOBES - 2 for k in range(LOBES)])


def _moves(kind: int, *by: tuple[int, float]) -> Floats:
    """(20,) change of one kind in some lobes."""
    change = np.zeros((4, LOBES))
    for lobe, amount in by:
        change[kind, lobe] = amount
    return change.ravel()


def _freedom(target: Target, column: int) -> Floats:
    """(20, k) changes that a fit may make: of lobes in the plane, then of the pair."""
    left, right = (LOBES - 2, 1.0), (LOBES - 1, 1.0)
    if column == VIEWS - 1:  # seen along the normal a lobe is round, and so is what is fitted
        return np.stack(
            [_moves(kind, *of) for of in ([(0, 1.0)], [left, right]) for kind in (_WIDE, _SHARE)], 1
        )
    in_plane = [_moves(kind, (k, 1.0)) for k in range(_IN_PLANE[column]) for kind in (_PLACE, _WIDE, _SHARE)]
    if _is_long(target):
        pair = [_moves(kind, one) for one in (left, right) for kind in (_PLACE, _WIDE, _SHARE)]
    else:
        pair = [_moves(kind, left, right) for kind in (_PLACE, _WIDE, _SHARE)]
        pair += [_moves(_BESIDE, left, (LOBES - 1, -1.0))]
    return np.stack([*in_plane, *pair], axis=1)


def _is_long(target: Target) -> bool:
    return target.along > _LONG * target.across


def _arranged(start: Floats, target: Target, column: int) -> Floats:
    """(4, 5) the start with the pair as the lobe has it: beside the plane or in it."""
    made = start.copy()
    apart = made[_PLACE, -1] - made[_PLACE, -2]
    if _is_long(target) and abs(apart) < _SPLIT:
        made[_PLACE, -2:] = made[_PLACE, -2:].mean() + np.array([-0.5, 0.5]) * _SPLIT
    if not _is_long(target) and abs(made[_BESIDE, -2]) < _SPLIT:
        made[_BESIDE, -2:] = _SPLIT, -_SPLIT
    made[_BESIDE, :-2] = 0.0
    if _is_long(target) or column == VIEWS - 1:
        made[_BESIDE] = 0.0
    if column == VIEWS - 1:
        made[_PLACE] = 0.0
    return made


def _fit(target: Target, column: int, start: Floats, near: Floats) -> Floats:
    """(4, 5) places, distances from the plane, widths and shares, relative to the lobe's.

    near : the mean of the neighbours'
    """
    scale, free, kept = terms(target.degree)[2], _freedom(target, column), _kept(column)
    lengths = (free**2).sum(axis=0)
    start, near = (_arranged(one, target, column).ravel() for one in (start, near))
    first, middle = (free.T @ one / lengths for one in (start, near))
    fixed = np.where(free.any(axis=1), 0.0, start)
    kinds = np.abs(free).argmax(axis=0) // LOBES
    low, high = _bounds(target, kinds)
    held = _HELD * np.where(kinds == _SHARE, 0.5, 1.0)

    @lru_cache(maxsize=2)
    def reduced(vector: bytes) -> Floats:
        """Slopes and residuals as one triangle: the same lengths and angles in 16 rows instead of 8,000."""
        at = np.frombuffer(vector)
        numbers = (fixed + free @ at).reshape(4, LOBES)
        mixed, by = round_sum(_lobes(numbers, target, kept), target.degree)
        by[:, _PLACE] *= target.along
        by[:, _BESIDE] *= target.across
        off = (mixed - target.coefficients) * scale
        slopes = np.einsum("nk,kj->nj", by.reshape(len(by), -1), free) * scale[:, None]
        tall = np.column_stack([np.vstack([slopes, np.diag(held)]), np.append(off, held * (at - middle))])
        return triangle(np.vstack([tall.real, tall.imag]))

    def residual(vector: Floats) -> Floats:
        return reduced(vector.tobytes())[:, -1]

    def slopes_of(vector: Floats) -> Floats:
        return reduced(vector.tobytes())[:, :-1]

    inside = np.clip(first, low + 1e-4, high - 1e-4)
    done = least_squares(
        residual, inside, jac=slopes_of, bounds=(low, high), max_nfev=_STEPS, ftol=1e-4, xtol=1e-5
    )
    return np.asarray(fixed + free @ done.x).reshape(4, LOBES)


def _bounds(target: Target, kinds: NDArray[np.intp]) -> tuple[Floats, Floats]:
    smooth, rough = np.log([SMOOTHEST, ROUGHEST]) - np.log(target.across)
    low, high = (np.full(4, side * _FURTHEST) for side in (-1.0, 1.0))
    low[_BESIDE], high[_BESIDE] = 0.0, min(_FURTHEST, 0.45 * np.pi / target.across)
    low[_WIDE], high[_WIDE] = smooth, max(rough, smooth + 0.1)
    return low[kinds], high[kinds]


def _lobes(numbers: Floats, target: Target, kept: NDArray[np.bool_]) -> RoundLobes:
    place, beside, wide, share = numbers
    weight = np.where(kept, np.exp(share - share[kept].max()), 0.0)
    return RoundLobes(
        target.middle + place * target.along,
        beside * target.across,
        np.log(target.across) + wide,
        weight / weight.sum(),
    )
