"""Nonlinear least squares for the variances of Gaussians, with optimal weights at each step.

Sources: [GolubPereyra1973] for the method, [Kaufman1975] for its derivatives, [Marquardt1963] for the steps,
[Anderson1965] for the extrapolation of steps.
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
    """Sum of Gaussians at one step of a fit, with the derivatives that the next step needs.

    log_variance : (k,) logarithms of the variances
    weight : (k, c) weights in c channels, optimal for these variances
    cost : sum of squared residuals
    gradient : (k,) gradient of half the cost with respect to the logarithms
    curvature : (k, k) Gauss-Newton matrix of half the cost with respect to the logarithms
    """

    log_variance: Floats
    weight: Floats
    cost: float
    gradient: Floats
    curvature: Floats


def minimise(
    design_function: DesignFunction,
    samples: Floats,
    log_variance: Floats,
    log_variance_bounds: tuple[float, float],
    cost_tolerance: float = COST_TOLERANCE,
) -> WeightedFit:
    """Return the fit at a local minimum of the squared residuals, found by descent from given variances.

    design_function : function from k variances to the samples (n, k) of unit Gaussians, and to the
        derivatives (n, k) of these samples with respect to the logarithms of the variances
    samples : (n, c) data to fit
    log_variance : (k,) logarithms of the variances from which the descent starts
    log_variance_bounds : smallest and largest logarithm of a variance
    cost_tolerance : relative decrease of the cost below which the descent stops
    """
    fit = _optimal_weights(design_function, samples, log_variance)
    damping, previous = 1e-2, None
    for _ in range(_MAX_STEP_COUNT):
        step = _marquardt_step(fit, damping)
        update = step if previous is None else _anderson_step(fit.log_variance, step, *previous)
        trial = _optimal_weights(
            design_function, samples, np.clip(fit.log_variance + update, *log_variance_bounds)
        )
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


def _marquardt_step(weighted_fit: WeightedFit, damping: float) -> Floats:
    scale = weighted_fit.curvature.diagonal()
    damped = weighted_fit.curvature + np.diag(damping * (scale + 1e-12 * scale.max()))
    step = -np.linalg.lstsq(damped, weighted_fit.gradient, rcond=None)[0]
    return np.asarray(np.clip(step, -_MAX_LOG_VARIANCE_STEP, _MAX_LOG_VARIANCE_STEP))


def _anderson_step(
    log_variance: Floats, step: Floats, last_log_variance: Floats, last_step: Floats
) -> Floats:
    """Return a step extrapolated from the last two steps by Anderson acceleration [Anderson1965].

    Plain steps neglect the curvature of the residuals and converge linearly. One extrapolated step replaces
    about a dozen plain steps.

    log_variance : (k,) current logarithms of the variances
    step : (k,) plain step from these logarithms
    last_log_variance : (k,) logarithms of the variances one iteration earlier
    last_step : (k,) plain step from these earlier logarithms
    """
    change = step - last_step
    size = float(change @ change)
    factor = float(step @ change) / size if size > 0.0 else 0.0
    extrapolated = step - factor * (log_variance - last_log_variance + change)
    return np.asarray(np.clip(extrapolated, -_MAX_LOG_VARIANCE_STEP, _MAX_LOG_VARIANCE_STEP))


def _optimal_weights(design_function: DesignFunction, samples: Floats, log_variance: Floats) -> WeightedFit:
    """Return the fit for given variances, with optimal non-negative weights, cost and derivatives.

    design_function, samples : as in `minimise`
    log_variance : (k,) logarithms of the variances
    """
    columns, slopes = design_function(np.exp(log_variance))
    k = len(log_variance)
    size = np.linalg.norm(columns, axis=0)
    # One QR factorisation reduces the problem of all channels to the space of these few columns.
    reduced = qr_factor(np.hstack([columns / size, slopes / size, samples]))
    weight = np.zeros((k, samples.shape[1]))
    cost, gradient, curvature = 0.0, np.zeros(k), np.zeros((k, k))
    for i, sample in enumerate(reduced.T[2 * k :]):
        weight[:, i], residual, jacobian = _solve_channel_weights(
            reduced[:, :k], reduced[:, k : 2 * k], sample
        )
        cost += float(residual @ residual)
        gradient += jacobian.T @ residual
        curvature += jacobian.T @ jacobian
    return WeightedFit(log_variance, weight / size[:, None], cost, gradient, curvature)


def qr_factor(matrix: Floats) -> Floats:
    """Return the upper triangular factor R of the QR factorisation of a tall matrix.

    Blocks of rows are factorised separately. For the whole matrix, BLAS would start threads, which would cost
    more time than they save.
    """
    blocks = np.array_split(matrix, -(-len(matrix) // _QR_ROWS_PER_BLOCK))
    factors = [np.asarray(np.linalg.qr(block, mode="r")) for block in blocks]
    return factors[0] if len(factors) == 1 else np.asarray(np.linalg.qr(np.vstack(factors), mode="r"))


def _solve_channel_weights(columns: Floats, slopes: Floats, sample: Floats) -> tuple[Floats, Floats, Floats]:
    from scipy.optimize import nnls

    weight: Floats = nnls(columns, sample)[0]
    positive = weight > 0.0
    Q, R = np.linalg.qr(columns[:, positive])
    weight[positive] = np.linalg.solve(R, Q.T @ sample)  # some versions of nnls square the condition number
    jacobian = slopes * weight
    return weight, columns @ weight - sample, jacobian - Q @ (Q.T @ jacobian)
