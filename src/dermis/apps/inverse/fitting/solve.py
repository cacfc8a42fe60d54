"""Least squares of skin and light over frames: strengths of lights linearly, the rest by damped Gauss-Newton;
standard deviations of the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.frames import FaceRenderer
from dermis.apps.inverse.fitting.light_basis import BASIS, solve_strengths
from dermis.apps.inverse.fitting.unknowns import SUN_SD, SUN_STEP, SKIN_UNKNOWNS, WHITE_SD, FitPoint
from dermis.optics.media import Floats

_NOISE_FLOOR = 0.03
"""Of the median of the photograph: what darker pixels are known to, as noise does not fall with them."""
ROBUST_LIMIT = 3.0
"""Standard deviations from which a residual counts less [Huber1964]."""
_MAD_TO_SD = 1.4826
_MAX_STEPS = 8
_STEP_TOLERANCE = 0.01
_MIN_GAIN = 1e-4
_DAMPING = 1e-3
_MAX_TRIALS = 3
_MAX_STEP = 0.7  # step of a logarithm or a direction


@dataclass(frozen=True, eq=False)
class FitState:
    """Point with the strengths of lights that fit best there.

    basis : (9 + k, p, 3) radiance in each light alone
    weight : (p, 3) one over the standard deviation of each pixel, robust ones
    """

    point: FitPoint
    strengths: Floats
    basis: Floats
    residual: Floats
    weight: Floats
    cost: float


@dataclass(frozen=True, eq=False)
class FitProblem:
    """Photograph to be fitted.

    target : (p, 3) radiance of the pixels that count, the given white taken out
    noise : relative standard deviation of a pixel
    free_white : whether the colour of the light is looked for
    """

    frames: FaceRenderer
    target: Floats
    noise: float
    free_white: bool
    robust: float = ROBUST_LIMIT

    def weights(self, shown: Floats) -> Floats:
        """Return the inverse standard deviation (p, 3) of pixels of a radiance."""
        return np.asarray(1.0 / (self.noise * (shown + _NOISE_FLOOR * float(np.median(self.target)))))

    def even_weights(self) -> Floats:
        """Return weights by the photograph's own brightness, before there is a model of it."""
        return self.weights(self.target.mean(axis=1, keepdims=True) * np.ones(3))

    def state(self, point: FitPoint, weight: Floats) -> FitState:
        """Return the state with the best light at a point."""
        return self._state(point, self.frames.basis(point) * light_tint(point), weight)

    def reweighed(self, state: FitState) -> FitState:
        """Return the state with weights by the model's brightness, less for what it cannot explain."""
        plain = self.weights(np.maximum(self.target - state.residual, 0.0))
        scaled = np.abs(state.residual * plain)
        limit = self.robust * max(_MAD_TO_SD * float(np.median(scaled)), 1.0)
        return self._state(state.point, state.basis, plain * np.sqrt(limit / np.maximum(scaled, limit)))

    def _state(self, point: FitPoint, basis: Floats, weight: Floats) -> FitState:
        A = (basis * weight).reshape(len(basis), -1).T
        x = solve_strengths(A, (self.target * weight).ravel())
        residual = self.target - np.einsum("a,apc->pc", x, basis)
        prior = (self.far(point) / self.believed(2 * len(point.suns))) ** 2
        cost = float(((residual * weight) ** 2).sum()) + float(prior.sum())
        return FitState(point, x, basis, residual, weight, cost)

    def slopes(self, state: FitState, name: str) -> Floats:
        """Return derivatives of the picture (p, 3, u) by finite differences of frames in all lights."""
        point, count = state.point, 2 * len(state.point.suns)
        middle = self.frames.together(point, state.strengths, name)
        found = []
        for k, step in enumerate(self.steps(count)):
            change = np.zeros(len(SKIN_UNKNOWNS) + count + 2)
            change[k] = (
                step if k >= len(SKIN_UNKNOWNS) or point.logs[k] + step < np.log(SKIN_UNKNOWNS[k].high) else -step
            )
            other = self.frames.together(point.moved(change), state.strengths, name)
            found.append((other - middle) / change[k])
        shown, white = middle * light_tint(point), np.zeros((2, *middle.shape))
        white[0, :, 0], white[1, :, 2] = shown[:, 0], shown[:, 2]
        slopes = np.concatenate([np.asarray(found) * light_tint(point), white])
        return np.moveaxis(slopes, 0, -1)

    def steps(self, turns: int) -> list[float]:
        """Return the steps of finite differences."""
        return [one.step for one in SKIN_UNKNOWNS] + [SUN_STEP] * turns

    def believed(self, turns: int) -> Floats:
        """Return the standard deviation of the prior of each number (u,)."""
        white = WHITE_SD if self.free_white else 1e-6
        return np.array([one.spread for one in SKIN_UNKNOWNS] + [SUN_SD] * turns + [white] * 2)

    def far(self, point: FitPoint) -> Floats:
        """Return the differences of the numbers from the means of their priors (u,); directions have none."""
        skin = point.logs - np.log([one.usual for one in SKIN_UNKNOWNS])
        return np.concatenate([skin, np.zeros(2 * len(point.suns)), point.white])


def light_tint(point: FitPoint) -> Floats:
    """Return the colour of the light relative to the given white (3,), green 1."""
    return np.array([np.exp(point.white[0]), 1.0, np.exp(point.white[1])])


def solve_fit(
    problem: FitProblem, start: FitPoint, told: Callable[[int, int], None] = lambda done, of: None
) -> tuple[FitState, Floats]:
    """Return the best state, and derivatives (p, 3, u) at most one step before it.

    By variable projection [GolubPereyra1973] with Kaufman's derivative [Kaufman1975]: lights are eliminated.
    """
    state = problem.reweighed(problem.state(start, problem.even_weights()))
    damping = _DAMPING
    for turn in range(_MAX_STEPS):
        told(turn, _MAX_STEPS)
        slopes = problem.slopes(state, f"light_{turn}")
        better, step, damping = _improve(problem, state, slopes, damping)
        if better is None:
            return state, slopes
        gain = 1.0 - better.cost / state.cost
        state = problem.reweighed(better)
        if np.abs(step).max() < _STEP_TOLERANCE or gain < _MIN_GAIN:
            break
    return state, slopes


def _improve(
    problem: FitProblem, state: FitState, slopes: Floats, damping: float
) -> tuple[FitState | None, Floats, float]:
    """Return a better state or None, the step to it and the damping for the next."""
    H, g = _normal_equations(problem, state, slopes)
    for _ in range(_MAX_TRIALS):
        step = np.asarray(np.linalg.solve(H + damping * np.diag(np.diag(H)), g), np.float64)
        step *= min(1.0, _MAX_STEP / max(float(np.abs(step).max()), 1e-12))
        if np.abs(step).max() < 0.1 * _STEP_TOLERANCE:
            break
        trial = problem.state(state.point.moved(step), state.weight)
        if trial.cost < state.cost:
            return trial, step, max(0.2 * damping, 1e-6)
        damping = max(30.0 * damping, 0.03)
    return None, np.zeros(len(g)), damping


def _normal_equations(problem: FitProblem, state: FitState, slopes: Floats) -> tuple[Floats, Floats]:
    """Return the curvature and the negative gradient of half the cost, with lights eliminated."""
    J = (slopes * state.weight[..., None]).reshape(-1, slopes.shape[-1])
    J, r = _eliminate_lights(state, J)
    spread = problem.believed(2 * len(state.point.suns))
    H = J.T @ J + np.diag(spread**-2.0)
    return H, J.T @ r - problem.far(state.point) / spread**2


def _eliminate_lights(state: FitState, J: Floats) -> tuple[Floats, Floats]:
    """Return weighted derivatives less what the lights can follow, suns at 0 excepted, and the residual."""
    free = [k for k in range(len(state.basis)) if k < BASIS or state.strengths[k] > 0.0]
    Q = np.linalg.qr((state.basis[free] * state.weight).reshape(len(free), -1).T)[0]
    return J - Q @ (Q.T @ J), (state.residual * state.weight).ravel()


_BLOCK_COUNT = 16
"""Along the longer side: what the frame gets wrong is alike within one."""
_LIMIT_TOLERANCE = 1e-6
_MIN_PRIOR_RATIO = 0.5
_MIN_CORRELATION = 0.95


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Uncertainty of the unknowns by name, all as logarithms or angles.

    sd : standard deviations, from residuals that are correlated within blocks of the picture
    held : names whose deviation is more than half of their prior's, which determines them, and those that
        ended on a limit
    alike : pairs that the photograph cannot tell apart, with their correlation
    singular : singular values of the derivatives in units of the priors, largest first
    """

    sd: dict[str, float]
    held: tuple[str, ...]
    alike: tuple[tuple[str, str, float], ...]
    singular: tuple[float, ...]


def fit_uncertainty(problem: FitProblem, state: FitState, slopes: Floats) -> Uncertainty:
    """Return the uncertainty by derivatives with lights eliminated, over blocks of pixels [White1980]."""
    turns = 2 * len(state.point.suns)
    suns = [f"sun {k + 1} {way}" for k in range(turns // 2) for way in ("across", "along")]
    names = [*(one.name for one in SKIN_UNKNOWNS), *suns, "white red", "white blue"]
    count = len(names) if problem.free_white else len(names) - 2
    J = (slopes * state.weight[..., None]).reshape(-1, len(names))[:, :count]
    J, r = _eliminate_lights(state, J)
    spread = problem.believed(turns)[:count]
    H = np.linalg.inv(J.T @ J + np.diag(spread**-2.0))
    block = np.repeat(_pixel_blocks(problem.frames), 3)
    sums = np.stack([np.bincount(block, column) for column in (J * r[:, None]).T], axis=-1)
    covariance = H @ (sums.T @ sums + np.diag(spread**-2.0)) @ H
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    found = state.point.values()
    inside = {one.name: one.low * (1 + _LIMIT_TOLERANCE) < found[one.name] < one.high * (1 - _LIMIT_TOLERANCE) for one in SKIN_UNKNOWNS}
    each = zip(names, sd, spread, strict=False)
    held = tuple(name for name, one, prior in each if one > _MIN_PRIOR_RATIO * prior or not inside.get(name, True))
    alike = tuple(
        (names[a], names[b], float(correlation[a, b]))
        for a in range(count)
        for b in range(a)
        if abs(correlation[a, b]) > _MIN_CORRELATION and names[a][:5] != names[b][:5]
    )
    singular = np.linalg.svd(J * spread, compute_uv=False)
    return Uncertainty(dict(zip(names, map(float, sd), strict=False)), held, alike, tuple(map(float, singular)))


def _pixel_blocks(frames: FaceRenderer) -> NDArray[np.int64]:
    """Return the number of each pixel's block (p,)."""
    rows, columns = np.nonzero(frames.mask)
    side = max(1, max(frames.mask.shape) // _BLOCK_COUNT)
    return np.asarray(rows // side * (_BLOCK_COUNT * 2) + columns // side, np.int64)
