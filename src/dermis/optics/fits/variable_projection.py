"""Nonlinear least squares over the variances of Gaussians, with optimal weights at each step.

Sources: [GolubPereyra1973] for the method, [Kaufman1975] for its derivatives, [Marquardt1963] for the steps,
[Anderson1965] for their extrapolation.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from dermis.optics.media import Floats

DesignFunction = Callable[[Floats], tuple[Floats, Floats]]
_MAX_STEP_COUNT = 100
_MAX_LOG_VARIANCE_STEP = 1.0
COST_TOLERANCE = 1e-7
"""Relative decrease of the cost below which the descent stops."""
_MAX_MARQUARDT_DAMPING = 1e8
_QR_ROWS_PER_BLOCK = 512


class WeightedFit(NamedTuple):
    """Gaussians of the current step with optimal weights, and derivatives for the next step.

    log_variance : (k,) logarithms of the variances
    weight : (k, c) weights in c channels
    cost : sum of squared residuals
    gradient, curvature : (k,) gradient and (k, k) Gauss-Newton matrix of half the cost by log variance
    """

    log_variance: Floats
    weight: Floats
    cost: float
    gradient: Floats
    curvature: Floats


def minimise(
    design: DesignFunction,
    samples: Floats,
    log_variance: Floats,
    log_variance_bounds: tuple[float, float],
    cost_tolerance: float = COST_TOLERANCE,
) -> WeightedFit:
    """Return the fit at a local minimum of the squared residuals, reached by descent from start variances.

    design : function from variances to the samples of unit Gaussians (n, k), and their derivatives by log
        variance
    samples : (n, c) data to fit
    log_variance : (k,) logarithms of the start variances
    log_variance_bounds : smallest and largest log variance
    cost_tolerance : relative decrease of the cost below which the descent stops
    """
    fit = _optimal_weights(design, samples, log_variance)
    damping, previous = 1e-2, None
    for _ in range(_MAX_STEP_COUNT):
        step = _marquardt_step(fit, damping)
        update = step if previous is None else _anderson_step(fit.log_variance, step, *previous)
        trial = _optimal_weights(design, samples, np.clip(fit.log_variance + update, *log_variance_bounds))
        if trial.cost < fit.cost:
            converged = fit.cost - trial.cost < cost_tolerance * fit.cost
            previous = fit.log_variance, step
            fit, damping = trial, max(damping / 5.0, 1e-12)
            if converged:
                break
        elif previous is not None:
            previous = None
        else:
            damping = max(4.0 * damping, 1e-6)
            if damping > _MAX_MARQUARDT_DAMPING:
                break
    return fit


def _marquardt_step(fit: WeightedFit, damping: float) -> Floats:
    scale = fit.curvature.diagonal()
    damped = fit.curvature + np.diag(damping * (scale + 1e-12 * scale.max()))
    step = -np.linalg.lstsq(damped, fit.gradient, rcond=None)[0]
    return np.asarray(np.clip(step, -_MAX_LOG_VARIANCE_STEP, _MAX_LOG_VARIANCE_STEP))


def _anderson_step(
    log_variance: Floats, step: Floats, last_log_variance: Floats, last_step: Floats
) -> Floats:
    """Return the step of Anderson acceleration, extrapolated from the last two steps [Anderson1965].

    Plain steps neglect the curvature of the residuals and converge linearly; one extrapolated step replaces a
    dozen plain steps.
    """
    change = step - last_step
    size = float(change @ change)
    factor = float(step @ change) / size if size > 0.0 else 0.0
    extrapolated = step - factor * (log_variance - last_log_variance + change)
    return np.asarray(np.clip(extrapolated, -_MAX_LOG_VARIANCE_STEP, _MAX_LOG_VARIANCE_STEP))


def _optimal_weights(design: DesignFunction, samples: Floats, log_variance: Floats) -> WeightedFit:
    """Compute optimal non-negative weights for given variances, with cost and derivatives."""
    columns, slopes = design(np.exp(log_variance))
    k = len(log_variance)
    size = np.linalg.norm(columns, axis=0)
    # One QR factorisation reduces the problem of all channels to the space of these few columns.
    reduced = qr_factor(np.hstack([columns / size, slopes / size, samples]))
    weight = np.zeros((k, samples.shape[1]))
    cost, gradient, curvature = 0.0, np.zeros(k), np.zeros((k, k))
    for i, sample in enumerate(reduced.T[2 * k :]):
        weight[:, i], residual, jacobian = _solve_channel(reduced[:, :k], reduced[:, k : 2 * k], sample)
        cost += float(residual @ residual)
        gradient += jacobian.T @ residual
        curvature += jacobian.T @ jacobian
    return WeightedFit(log_variance, weight / size[:, None], cost, gradient, curvature)


def qr_factor(matrix: Floats) -> Floats:
    """Return the upper triangular factor R of the QR factorisation of a tall matrix.

    Blocks of rows are factorised separately, because BLAS would start threads for the whole matrix that cost
    more than they save.
    """
    blocks = np.array_split(matrix, -(-len(matrix) // _QR_ROWS_PER_BLOCK))
    factors = [np.asarray(np.linalg.qr(block, mode="r")) for block in blocks]
    return factors[0] if len(factors) == 1 else np.asarray(np.linalg.qr(np.vstack(factors), mode="r"))


def _solve_channel(columns: Floats, slopes: Floats, sample: Floats) -> tuple[Floats, Floats, Floats]:
    from scipy.optimize import nnls

    weight: Floats = nnls(columns, sample)[0]
    positive = weight > 0.0
    Q, R = np.linalg.qr(columns[:, positive])
    weight[positive] = np.linalg.solve(R, Q.T @ sample)  # some versions of nnls square the condition number
    jacobian = slopes * weight
    return weight, columns @ weight - sample, jacobian - Q @ (Q.T @ jacobian)
