"""Round lobes in the plane of view and beside it that stand for a surface's, by least squares over skies."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from dermis.environment.lobe_harmonics import (
    IsotropicLobes,
    LobeTarget,
    harmonic_terms,
    isotropic_sum,
    lobe_target,
)
from dermis.environment.prefilter import ROUGHEST, SMOOTHEST
from dermis.optics.fits.variable_projection import qr_factor
from dermis.specular.models import Lobe

Floats = NDArray[np.float64]
Node = tuple[int, int]
ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT = 12, 16, 5
LOBE_TABLE_ROUGHNESSES = np.geomspace(0.05, 1.0, ROUGHNESS_COUNT)
"""Of the table's rows."""
LOBE_TABLE_COSINES = np.maximum(np.linspace(0.0, 1.0, VIEW_COUNT) ** 2, 0.02)
"""Cosines of the table's columns; the first stand for 0."""
_IN_PLANE_LOBES = (3,) * 10 + (2,) * 3 + (1,) * 3
"""By column: lobes that lie in the plane whatever the roughness, beside the pair."""
_ELONGATED = 1.8  # times as long as wide: from here on the pair lies in the plane too, one behind the other
_PASSES = 2
_REGULARISATION = 0.01  # keeps lobes near the mean of their neighbours', where light leaves them undetermined
_MAX_EVALUATIONS = 30
_MAX_OFFSET = 5.0  # in widths of the lobe from its middle, and for logarithms of weights
_PAIR_SEPARATION = 0.4  # of a pair that comes into the plane, from where it was
_POSITION, _OUT_OF_PLANE, _LOG_WIDTH, _LOG_WEIGHT = range(4)
_INITIAL_LOBES = np.array(
    [
        [-1.0, 1.0, -0.3, 0.3, 0.3],
        [0.0, 0.0, 0.0, 0.8, -0.8],
        [-0.3, -1.0, -0.5, -0.7, -0.7],
        [0.0] * LOBE_COUNT,
    ]
)


def fit_isotropic_lobes(lobe: Lobe) -> Floats:
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
        (i, j): lobe_target(lobe, float(LOBE_TABLE_COSINES[j]), float(LOBE_TABLE_ROUGHNESSES[i]))
        for i, j in _nodes()
    }
    for _ in range(_PASSES):
        for i, j in _nodes():
            neighbours = [found[at] for at in ((i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)) if at in found]
            mean_angle = np.mean(neighbours, axis=0) if neighbours else _INITIAL_LOBES
            found[i, j] = _fit(targets[i, j], j, found.get((i, j), mean_angle), mean_angle)
    table = np.empty((ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT, 4))
    for i, j in _nodes():
        lobes = _lobes(found[i, j], targets[i, j], _active_lobes(j))
        table[i, j] = np.stack(
            [lobes.angle, lobes.out_of_plane, np.exp(lobes.log_roughness), lobes.weight], axis=-1
        )
    return table


def _nodes() -> Iterator[Node]:
    return ((i, j) for i in reversed(range(ROUGHNESS_COUNT)) for j in range(VIEW_COUNT))


def _active_lobes(column: int) -> NDArray[np.bool_]:
    """(5,) which lobes there are."""
    return np.array([k < _IN_PLANE_LOBES[column] or k >= LOBE_COUNT - 2 for k in range(LOBE_COUNT)])


def _change(kind: int, *by: tuple[int, float]) -> Floats:
    """(20,) change of one kind in some lobes."""
    change = np.zeros((4, LOBE_COUNT))
    for lobe, amount in by:
        change[kind, lobe] = amount
    return change.ravel()


def _free_changes(target: LobeTarget, column: int) -> Floats:
    """(20, k) changes that a fit may make: of lobes in the plane, then of the pair."""
    left, right = (LOBE_COUNT - 2, 1.0), (LOBE_COUNT - 1, 1.0)
    if column == VIEW_COUNT - 1:  # seen along the normal a lobe is round, and so is what is fitted
        return np.stack(
            [_change(kind, *of) for of in ([(0, 1.0)], [left, right]) for kind in (_LOG_WIDTH, _LOG_WEIGHT)],
            1,
        )
    in_plane = [
        _change(kind, (k, 1.0))
        for k in range(_IN_PLANE_LOBES[column])
        for kind in (_POSITION, _LOG_WIDTH, _LOG_WEIGHT)
    ]
    if _is_elongated(target):
        pair = [_change(kind, one) for one in (left, right) for kind in (_POSITION, _LOG_WIDTH, _LOG_WEIGHT)]
    else:
        pair = [_change(kind, left, right) for kind in (_POSITION, _LOG_WIDTH, _LOG_WEIGHT)]
        pair += [_change(_OUT_OF_PLANE, left, (LOBE_COUNT - 1, -1.0))]
    return np.stack([*in_plane, *pair], axis=1)


def _is_elongated(target: LobeTarget) -> bool:
    return target.along_deviation > _ELONGATED * target.across_deviation


def _arrange_pair(start: Floats, target: LobeTarget, column: int) -> Floats:
    """(4, 5) the start with the pair as the lobe has it: beside the plane or in it."""
    lobes = start.copy()
    apart = lobes[_POSITION, -1] - lobes[_POSITION, -2]
    if _is_elongated(target) and abs(apart) < _PAIR_SEPARATION:
        lobes[_POSITION, -2:] = lobes[_POSITION, -2:].mean() + np.array([-0.5, 0.5]) * _PAIR_SEPARATION
    if not _is_elongated(target) and abs(lobes[_OUT_OF_PLANE, -2]) < _PAIR_SEPARATION:
        lobes[_OUT_OF_PLANE, -2:] = _PAIR_SEPARATION, -_PAIR_SEPARATION
    lobes[_OUT_OF_PLANE, :-2] = 0.0
    if _is_elongated(target) or column == VIEW_COUNT - 1:
        lobes[_OUT_OF_PLANE] = 0.0
    if column == VIEW_COUNT - 1:
        lobes[_POSITION] = 0.0
    return lobes


def _fit(target: LobeTarget, column: int, start: Floats, neighbours: Floats) -> Floats:
    """(4, 5) places, distances from the plane, widths and shares, relative to the lobe's.

    near : the mean of the neighbours'
    """
    scale, free, active = (
        harmonic_terms(target.degree)[2],
        _free_changes(target, column),
        _active_lobes(column),
    )
    lengths = (free**2).sum(axis=0)
    start, neighbours = (_arrange_pair(one, target, column).ravel() for one in (start, neighbours))
    first, mean_angle = (free.T @ one / lengths for one in (start, neighbours))
    fixed = np.where(free.any(axis=1), 0.0, start)
    kinds = np.abs(free).argmax(axis=0) // LOBE_COUNT
    low, high = _bounds(target, kinds)
    regularisation = _REGULARISATION * np.where(kinds == _LOG_WEIGHT, 0.5, 1.0)

    @lru_cache(maxsize=2)
    def reduced(vector: bytes) -> Floats:
        """Slopes and residuals as one triangle: the same lengths and angles in 16 rows instead of 8,000."""
        at = np.frombuffer(vector)
        numbers = (fixed + free @ at).reshape(4, LOBE_COUNT)
        mixed, by = isotropic_sum(_lobes(numbers, target, active), target.degree)
        by[:, _POSITION] *= target.along_deviation
        by[:, _OUT_OF_PLANE] *= target.across_deviation
        off = (mixed - target.coefficients) * scale
        slopes = np.einsum("nk,kj->nj", by.reshape(len(by), -1), free) * scale[:, None]
        tall = np.column_stack(
            [np.vstack([slopes, np.diag(regularisation)]), np.append(off, regularisation * (at - mean_angle))]
        )
        return qr_factor(np.vstack([tall.real, tall.imag]))

    def residual(vector: Floats) -> Floats:
        return reduced(vector.tobytes())[:, -1]

    def slopes_of(vector: Floats) -> Floats:
        return reduced(vector.tobytes())[:, :-1]

    inside = np.clip(first, low + 1e-4, high - 1e-4)
    solution = least_squares(
        residual, inside, jac=slopes_of, bounds=(low, high), max_nfev=_MAX_EVALUATIONS, ftol=1e-4, xtol=1e-5
    )
    return np.asarray(fixed + free @ solution.x).reshape(4, LOBE_COUNT)


def _bounds(target: LobeTarget, kinds: NDArray[np.intp]) -> tuple[Floats, Floats]:
    smooth, log_roughness = np.log([SMOOTHEST, ROUGHEST]) - np.log(target.across_deviation)
    low, high = (np.full(4, side * _MAX_OFFSET) for side in (-1.0, 1.0))
    low[_OUT_OF_PLANE], high[_OUT_OF_PLANE] = 0.0, min(_MAX_OFFSET, 0.45 * np.pi / target.across_deviation)
    low[_LOG_WIDTH], high[_LOG_WIDTH] = smooth, max(log_roughness, smooth + 0.1)
    return low[kinds], high[kinds]


def _lobes(numbers: Floats, target: LobeTarget, active: NDArray[np.bool_]) -> IsotropicLobes:
    position, out_of_plane, log_width, share = numbers
    weight = np.where(active, np.exp(share - share[active].max()), 0.0)
    return IsotropicLobes(
        target.mean_angle + position * target.along_deviation,
        out_of_plane * target.across_deviation,
        np.log(target.across_deviation) + log_width,
        weight / weight.sum(),
    )
