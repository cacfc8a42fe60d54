"""Least-squares fit of skin and light.

Light strengths are linear unknowns. All other unknowns are found by damped Gauss-Newton steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.frames import FaceRenderer
from dermis.apps.inverse.fitting.light_basis import AMBIENT_LOBE_COUNT, solve_light_strengths
from dermis.apps.inverse.fitting.unknowns import (
    SKIN_UNKNOWNS,
    SUN_PRIOR_SD,
    SUN_STEP_RAD,
    WHITE_PRIOR_SD,
    FitUnknowns,
)
from dermis.base.renamed import renamed_attribute
from dermis.optics.media import Floats

_NOISE_FLOOR_FRACTION = 0.03
"""Radiance that is added to a pixel's radiance when the pixel's standard deviation is computed, as a fraction
of the photograph's median radiance [-]. It limits the weight of dark pixels."""
ROBUST_LIMIT_SD = 3.0
"""Number of standard deviations above which the weight of a residual decreases [Huber1964]."""
NO_ADDITIONAL_SD: Mapping[str, float] = MappingProxyType({})
_MAD_TO_SD = 1.4826
_MAX_ITERATIONS = 8
_STEP_TOLERANCE = 0.01
_MIN_RELATIVE_COST_DECREASE = 1e-4
_INITIAL_DAMPING = 1e-3
_MAX_DAMPING_TRIALS = 3
_MAX_STEP_PER_UNKNOWN = 0.7  # largest step of a logarithm or of a direction [rad]


@dataclass(frozen=True, eq=False)
class FitState:
    """Unknowns of a fit at one step, with the light strengths that fit best and the residual.

    unknowns : skin, directions of the suns, and colour of the light
    strengths : (9 + k,) strengths of the ambient lobes and of the suns
    basis : (9 + k, p, 3) radiance of the p fitted pixels under each light alone
    residual : (p, 3) radiance of the photograph minus radiance of the model
    weight : (p, 3) inverse standard deviation of each pixel, lowered for outliers
    cost : sum of the squared weighted residuals, plus the sum of the squared differences of the unknowns from
        the means of their priors, in standard deviations of the priors
    """

    unknowns: FitUnknowns
    strengths: Floats
    basis: Floats
    residual: Floats
    weight: Floats
    cost: float


@dataclass(frozen=True, eq=False)
class FitProblem:
    """Photograph to fit, with its noise, and the renderer of the face.

    frames : renderer of the face
    target : (p, 3) values of the photograph at the p fitted pixels (the pixels in the mask of `frames`),
        divided by the exposure and by the light colour that the user gives
    noise : relative standard deviation of a pixel [-]
    free_white : whether the colour of the light is an unknown
    robust : number of standard deviations beyond which residuals have less weight
    """

    frames: FaceRenderer
    target: Floats
    noise: float
    free_white: bool
    robust: float = ROBUST_LIMIT_SD

    def pixel_weights(self, radiance: Floats) -> Floats:
        """Return the inverse standard deviations (p, 3) of pixels with a given radiance."""
        return np.asarray(
            1.0 / (self.noise * (radiance + _NOISE_FLOOR_FRACTION * float(np.median(self.target))))
        )

    def initial_weights(self) -> Floats:
        """Return the weights (p, 3) of the pixels at the start of a fit, before any frame is rendered.

        They are inverse standard deviations, estimated from the brightness of the photograph's pixels.
        """
        return self.pixel_weights(self.target.mean(axis=1, keepdims=True) * np.ones(3))

    def render_state(self, fit_unknowns: FitUnknowns, pixel_weight: Floats) -> FitState:
        """Render the face for given unknowns; return the state with the best light strengths."""
        return self._best_light_state(
            fit_unknowns,
            self.frames.single_light_radiance(fit_unknowns) * light_tint(fit_unknowns),
            pixel_weight,
        )

    def reweighted_state(self, fit_state: FitState) -> FitState:
        """Return the state with new weights of the pixels, and with the best light strengths for them.

        The weights are inverse standard deviations of pixels with the radiance of the model; pixels that
        differ much from the model get less weight.
        """
        weights = self.pixel_weights(np.maximum(self.target - fit_state.residual, 0.0))
        scaled = np.abs(fit_state.residual * weights)
        limit = self.robust * max(_MAD_TO_SD * float(np.median(scaled)), 1.0)
        weights *= np.sqrt(limit / np.maximum(scaled, limit))
        return self._best_light_state(fit_state.unknowns, fit_state.basis, weights)

    def _best_light_state(self, fit_unknowns: FitUnknowns, basis: Floats, pixel_weight: Floats) -> FitState:
        A = (basis * pixel_weight).reshape(len(basis), -1).T
        x = solve_light_strengths(A, (self.target * pixel_weight).ravel())
        residual = self.target - np.einsum("a,apc->pc", x, basis)
        prior = (self.prior_offsets(fit_unknowns) / self.prior_sd(2 * len(fit_unknowns.suns))) ** 2
        cost = float(((residual * pixel_weight) ** 2).sum()) + float(prior.sum())
        return FitState(fit_unknowns, x, basis, residual, pixel_weight, cost)

    def derivatives(self, fit_state: FitState, frame_name: str) -> Floats:
        """Return the derivatives (p, 3, u) of the radiance with respect to the u unknowns.

        Most of them are finite differences between frames.

        frame_name : file name of the ambient light's panorama, without suffix
        """
        unknowns, count = fit_state.unknowns, 2 * len(fit_state.unknowns.suns)
        centre = self.frames.combined_radiance(unknowns, fit_state.strengths, frame_name)
        shifted = []
        for k, step in enumerate(self.difference_steps(count)):
            change = np.zeros(len(SKIN_UNKNOWNS) + count + 2)
            limited = k < len(SKIN_UNKNOWNS) and unknowns.logs[k] + step >= np.log(SKIN_UNKNOWNS[k].high)
            change[k] = -step if limited else step
            neighbour = self.frames.combined_radiance(
                unknowns.stepped(change), fit_state.strengths, frame_name
            )
            shifted.append((neighbour - centre) / change[k])
        radiance, white = centre * light_tint(unknowns), np.zeros((2, *centre.shape))
        white[0, :, 0], white[1, :, 2] = radiance[:, 0], radiance[:, 2]
        derivatives = np.concatenate([np.asarray(shifted) * light_tint(unknowns), white])
        return np.moveaxis(derivatives, 0, -1)

    def difference_steps(self, sun_angle_count: int) -> list[float]:
        """Return the step of the finite difference for each skin unknown and each angle of a sun.

        sun_angle_count : number of angles that describe the directions of all suns
        """
        return [one.step for one in SKIN_UNKNOWNS] + [SUN_STEP_RAD] * sun_angle_count

    def prior_sd(self, sun_angle_count: int) -> Floats:
        """Return the standard deviation (u,) of each unknown's prior.

        sun_angle_count : number of angles that describe the directions of all suns
        """
        white = WHITE_PRIOR_SD if self.free_white else 1e-6
        return np.array(
            [one.prior_sd for one in SKIN_UNKNOWNS] + [SUN_PRIOR_SD] * sun_angle_count + [white] * 2
        )

    def prior_offsets(self, fit_unknowns: FitUnknowns) -> Floats:
        """Return the difference (u,) of each unknown from the mean of its prior.

        It is 0 for the angles that describe the directions of suns, because no direction is preferred.
        """
        skin = fit_unknowns.logs - np.log([one.prior_median for one in SKIN_UNKNOWNS])
        return np.concatenate([skin, np.zeros(2 * len(fit_unknowns.suns)), fit_unknowns.white])


def light_tint(fit_unknowns: FitUnknowns) -> Floats:
    """Return the ratio (3,) of the fitted light colour to the light colour given by the user; green is 1."""
    return np.array([np.exp(fit_unknowns.white[0]), 1.0, np.exp(fit_unknowns.white[1])])


def solve_fit(
    problem: FitProblem,
    start_unknowns: FitUnknowns,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[FitState, Floats]:
    """Minimise the cost from given start values; return the best state and derivatives of the radiance.

    The derivatives (p, 3, u) are with respect to the u unknowns. They belong to the best state if the search
    ended because no step improved it; otherwise, to the state before the last step.

    Light strengths are eliminated by variable projection [GolubPereyra1973] with Kaufman's derivative
    [Kaufman1975].

    progress : function called with the number of finished steps and the largest number of steps
    """
    state = problem.reweighted_state(problem.render_state(start_unknowns, problem.initial_weights()))
    damping = _INITIAL_DAMPING
    for iteration in range(_MAX_ITERATIONS):
        progress(iteration, _MAX_ITERATIONS)
        derivatives = problem.derivatives(state, f"light_{problem.frames.frame_count}")
        improved, step, damping = _try_damped_steps(problem, state, derivatives, damping)
        if improved is None:
            return state, derivatives
        gain = 1.0 - improved.cost / state.cost
        state = problem.reweighted_state(improved)
        if np.abs(step).max() < _STEP_TOLERANCE or gain < _MIN_RELATIVE_COST_DECREASE:
            break
    return state, derivatives


def _try_damped_steps(
    problem: FitProblem, fit_state: FitState, derivatives: Floats, damping: float
) -> tuple[FitState | None, Floats, float]:
    """Try steps with increasing damping until one lowers the cost.

    Returns the state of lower cost, or None if no step lowers the cost; the step; and the next damping.
    """
    H, g = _normal_equations(problem, fit_state, derivatives)
    for _ in range(_MAX_DAMPING_TRIALS):
        step = np.asarray(np.linalg.solve(H + damping * np.diag(np.diag(H)), g), np.float64)
        step *= min(1.0, _MAX_STEP_PER_UNKNOWN / max(float(np.abs(step).max()), 1e-12))
        if np.abs(step).max() < 0.1 * _STEP_TOLERANCE:
            break
        trial = problem.render_state(fit_state.unknowns.stepped(step), fit_state.weight)
        if trial.cost < fit_state.cost:
            return trial, step, max(0.2 * damping, 1e-6)
        damping = max(30.0 * damping, 0.03)
    return None, np.zeros(len(g)), damping


def _normal_equations(problem: FitProblem, fit_state: FitState, derivatives: Floats) -> tuple[Floats, Floats]:
    """Return the Gauss-Newton matrix and the negative gradient of half the cost.

    Both are for the unknowns other than light strengths, which are eliminated.
    """
    J = (derivatives * fit_state.weight[..., None]).reshape(-1, derivatives.shape[-1])
    J, r = _eliminate_lights(fit_state, J)
    prior_sd = problem.prior_sd(2 * len(fit_state.unknowns.suns))
    H = J.T @ J + np.diag(prior_sd**-2.0)
    return H, J.T @ r - problem.prior_offsets(fit_state.unknowns) / prior_sd**2


def _eliminate_lights(fit_state: FitState, weighted_derivatives: Floats) -> tuple[Floats, Floats]:
    """Return derivatives (3 p, u) without the part that lights can compensate, and weighted residuals (3 p,).

    There are p pixels of three channels, and u unknowns. The removed part is the change of the picture that a
    change of light strengths could cancel. Suns of strength 0 count as fixed: the best fit would give them a
    negative strength, which is not allowed.

    weighted_derivatives : (3 p, u) derivatives of the radiance, multiplied by the weights
    """
    free = [k for k in range(len(fit_state.basis)) if k < AMBIENT_LOBE_COUNT or fit_state.strengths[k] > 0.0]
    Q = np.linalg.qr((fit_state.basis[free] * fit_state.weight).reshape(len(free), -1).T)[0]
    return weighted_derivatives - Q @ (Q.T @ weighted_derivatives), (
        fit_state.residual * fit_state.weight
    ).ravel()


_BLOCKS_PER_SIDE = 16
"""Number of blocks along the longer side of the picture; residuals are correlated within a block."""
SYSTEMATIC_SD = {"melanin": 0.11, "blood": 0.1}
"""Standard deviations of the logarithms of pigments due to errors of the renderer. They are chosen so that
68 % of the errors of fits to path-traced faces are within one stated standard deviation, see docs/fit.md."""
_PARAMETER_LIMIT_TOLERANCE = 1e-6
_MIN_UNDETERMINED_SD_RATIO = 0.5
_MIN_NOTABLE_CORRELATION = 0.95


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Uncertainty of a fit's unknowns.

    sd : dictionary from name of an unknown to its standard deviation, which includes errors of the renderer
        and of assumed skin parameters. Directions have standard deviations of angles [rad]; skin parameters
        and the light's colour have standard deviations of logarithms
    undetermined : unknowns at a limit, and unknowns whose standard deviation is more than half the standard
        deviation of their prior
    correlated : pairs of unknowns that the photograph cannot separate, with their correlation
    singular_values : singular values, largest first, of the weighted derivatives of the radiance with respect
        to the unknowns, each unknown being measured in standard deviations of its prior
    """

    sd: dict[str, float]
    undetermined: tuple[str, ...]
    correlated: tuple[tuple[str, str, float], ...]
    singular_values: tuple[float, ...]
    held = renamed_attribute("held", "undetermined")


def fit_uncertainty(
    problem: FitProblem,
    fit_state: FitState,
    derivatives: Floats,
    sd_from_assumed_parameters: Mapping[str, float] = NO_ADDITIONAL_SD,
) -> Uncertainty:
    """Return the uncertainty of all unknowns.

    Residuals are taken as correlated within blocks of pixels, and as independent otherwise [White1980].

    derivatives : (p, 3, u) derivatives of the radiance with respect to the unknowns
    sd_from_assumed_parameters : dictionary from pigment name to a standard deviation of the pigment's
        logarithm, which is due to the values assumed for other skin parameters
    """
    sun_angles = 2 * len(fit_state.unknowns.suns)
    suns = [f"sun {k + 1} {axis}" for k in range(sun_angles // 2) for axis in ("across", "along")]
    names = [*(one.name for one in SKIN_UNKNOWNS), *suns, "white red", "white blue"]
    count = len(names) if problem.free_white else len(names) - 2
    J = (derivatives * fit_state.weight[..., None]).reshape(-1, len(names))[:, :count]
    J, r = _eliminate_lights(fit_state, J)
    prior_sd = problem.prior_sd(sun_angles)[:count]
    H = np.linalg.inv(J.T @ J + np.diag(prior_sd**-2.0))
    block = np.repeat(_pixel_blocks(problem.frames), 3)
    sums = np.stack([np.bincount(block, column) for column in (J * r[:, None]).T], axis=-1)
    covariance = H @ (sums.T @ sums + np.diag(prior_sd**-2.0)) @ H
    systematic = np.array(
        [np.hypot(SYSTEMATIC_SD.get(name, 0.0), sd_from_assumed_parameters.get(name, 0.0)) for name in names]
    )
    covariance += np.diag(systematic[:count] ** 2)
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    values, e = fit_state.unknowns.skin_values(), _PARAMETER_LIMIT_TOLERANCE
    free = {one.name: one.low * (1 + e) < values[one.name] < one.high * (1 - e) for one in SKIN_UNKNOWNS}
    uncertain = zip(names, sd > _MIN_UNDETERMINED_SD_RATIO * prior_sd, strict=False)
    undetermined = tuple(name for name, large in uncertain if large or not free.get(name, True))
    correlated = tuple(
        (names[a], names[b], float(correlation[a, b]))
        for a in range(count)
        for b in range(a)
        if abs(correlation[a, b]) > _MIN_NOTABLE_CORRELATION and names[a][:5] != names[b][:5]
    )
    singular_values = np.linalg.svd(J * prior_sd, compute_uv=False)
    sd_by_name = dict(zip(names, map(float, sd), strict=False))
    return Uncertainty(sd_by_name, undetermined, correlated, tuple(map(float, singular_values)))


def median_block_residual(problem: FitProblem, fit_state: FitState) -> float:
    """Return the median relative residual over blocks of the picture, which hardly depends on noise [-]."""
    block = _pixel_blocks(problem.frames)
    residual, target = (
        np.stack([np.bincount(block, column) for column in values.T])
        for values in (fit_state.residual, problem.target)
    )
    lit = target > 0.0
    return float(np.median(np.abs(residual[lit]) / target[lit]))


def _pixel_blocks(face_renderer: FaceRenderer) -> NDArray[np.int64]:
    """Divide the picture into square blocks; return the index (p,) of the block of each fitted pixel.

    The p fitted pixels are those in the renderer's mask.
    """
    rows, columns = np.nonzero(face_renderer.mask)
    side = max(1, max(face_renderer.mask.shape) // _BLOCKS_PER_SIDE)
    return np.asarray(rows // side * (_BLOCKS_PER_SIDE * 2) + columns // side, np.int64)
