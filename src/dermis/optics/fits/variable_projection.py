"""Least squares over the variances of Gaussians, with the best weights solved for at each step.

Source: [GolubPereyra1973] with the slopes of [Kaufman1975], steps after [Marquardt1963], extrapolated as in
[Anderson1965].
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from dermis.optics.media import Floats

Design = Callable[[Floats], tuple[Floats, Floats]]
_MOST_STEPS = 100
_LONGEST_STEP = 1.0
STILL = 1e-7
"""Share of the cost that a step must save for another one."""
_HOPELESS = 1e8
_BLOCK = 512


class Fit(NamedTuple):
    """Log variances (k,), weights (k, c), the sum of squared residuals, and what the next step needs."""

    log_variance: Floats
    weight: Floats
    cost: float
    gradient: Floats
    curvature: Floats


def descend(
    design: Design, samples: Floats, log_variance: Floats, bounds: tuple[float, float], still: float = STILL
) -> Fit:
    """The local minimum that descent from a start reaches.

    design : what a unit Gaussian of each variance adds to the samples, and its slope by log variance
    samples : (n, c)
    log_variance : (k,) start
    bounds : of the log variances
    still : share of the cost that a step must save for another one
    """
    fit = _project(design, samples, log_variance)
    damping, before = 1e-2, None
    for _ in range(_MOST_STEPS):
        step = _step(fit, damping)
        onwards = step if before is None else _extrapolated(fit.log_variance, step, *before)
        trial = _project(design, samples, np.clip(fit.log_variance + onwards, *bounds))
        if trial.cost < fit.cost:
            settled = fit.cost - trial.cost < still * fit.cost
            before = fit.log_variance, step
            fit, damping = trial, max(damping / 5.0, 1e-12)
            if settled:
                break
        elif before is not None:
            before = None
        else:
            damping = max(4.0 * damping, 1e-6)
            if damping > _HOPELESS:
                break
    return fit


def _step(fit: Fit, damping: float) -> Floats:
    scale = fit.curvature.diagonal()
    damped = fit.curvature + np.diag(damping * (scale + 1e-12 * scale.max()))
    step = -np.linalg.lstsq(damped, fit.gradient, rcond=None)[0]
    return np.asarray(np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))


def _extrapolated(place: Floats, step: Floats, last_place: Floats, last_step: Floats) -> Floats:
    """The step to where steps would vanish if they went on changing as they did from the last place.

    Without the residuals' own curvature each step goes the same small share of the way: a dozen become one.
    """
    change = step - last_step
    size = float(change @ change)
    share = float(step @ change) / size if size > 0.0 else 0.0
    onwards = step - share * (place - last_place + change)
    return np.asarray(np.clip(onwards, -_LONGEST_STEP, _LONGEST_STEP))


def _project(design: Design, samples: Floats, log_variance: Floats) -> Fit:
    """The best weights of 0 or more for these variances."""
    columns, slopes = design(np.exp(log_variance))
    k = len(log_variance)
    size = np.linalg.norm(columns, axis=0)
    # All that follows lives in the space of these few columns: one factorisation serves every channel.
    small = triangle(np.hstack([columns / size, slopes / size, samples]))
    weight = np.zeros((k, samples.shape[1]))
    cost, gradient, curvature = 0.0, np.zeros(k), np.zeros((k, k))
    for i, sample in enumerate(small.T[2 * k :]):
        weight[:, i], residual, jacobian = _solve_channel(small[:, :k], small[:, k : 2 * k], sample)
        cost += float(residual @ residual)
        gradient += jacobian.T @ residual
        curvature += jacobian.T @ jacobian
    return Fit(log_variance, weight / size[:, None], cost, gradient, curvature)


def triangle(tall: Floats) -> Floats:
    """The factor R of a QR factorisation, by blocks of rows.

    For a whole tall matrix BLAS starts threads that wait longer than they work.
    """
    blocks = np.array_split(tall, -(-len(tall) // _BLOCK))
    factors = [np.asarray(np.linalg.qr(block, mode="r")) for block in blocks]
    return factors[0] if len(factors) == 1 else np.asarray(np.linalg.qr(np.vstack(factors), mode="r"))


def _solve_channel(columns: Floats, slopes: Floats, sample: Floats) -> tuple[Floats, Floats, Floats]:
    from scipy.optimize import nnls

    weight: Floats = nnls(columns, sample)[0]
    lit = weight > 0.0
    Q, R = np.linalg.qr(columns[:, lit])
    weight[lit] = np.linalg.solve(R, Q.T @ sample)  # some versions of nnls square the condition number
    jacobian = slopes * weight
    return weight, columns @ weight - sample, jacobian - Q @ (Q.T @ jacobian)
