"""Skin colours as functions of melanin, blood and a third unknown, and their inverse in float64."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.skin_colours import colour_table

ThirdUnknown = Literal["none", "oxygen", "shade"]
MIN_REFLECTANCE = 1e-4
"""Lower limit of colours, below those of all skins [-]."""
BLOOD_ROOT_MEAN, BLOOD_ROOT_SD = 0.1, 0.1
"""Prior mean and standard deviation of the root of the blood fraction, which matter only where melanin hides
the blood."""
_NODES = 129  # along melanin and along blood
_OXYGEN_COUNT = 5
_OXYGEN_SD, _SHADE_SD, _FIXED_SD = 0.1, 0.3, 1e-3
_SHADE_RANGE = -3.0, 1.5  # of the logarithm of the shading


@dataclass(frozen=True, eq=False)
class SkinModel:
    """Table of skin colours by melanin, blood and a third unknown.

    log_colours : (k, n, n, 3) logarithms of diffuse reflectance in linear Rec. 709. The axes are k values of
        oxygen, and n values each of the roots of the melanin and blood fractions, all evenly spaced from 0 to
        1
    third : third unknown: "oxygen" is the oxygenated fraction of haemoglobin; "shade" is the logarithm of a
        factor common to all channels, such as uneven light in a photograph; "none" is not varied
    third_range : limits of the third unknown
    prior_mean, prior_sd : mean and standard deviation of its prior
    """

    log_colours: Floats
    third: ThirdUnknown
    third_range: tuple[float, float]
    prior_mean: float
    prior_sd: float

    def evaluate(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the logarithms (t, 3) of colours and their derivatives (t, 3, 3), channels first.

        Interpolation between nodes is linear.

        x : (t, 3) roots of the melanin and blood fractions, and the third unknown
        """
        third_count, nodes = len(self.log_colours), self.log_colours.shape[1]
        low, high = self.third_range
        i, u = _cell(x[:, 0], nodes)
        j, v = _cell(x[:, 1], nodes)
        fraction = (x[:, 2] - low) / (high - low)
        k, w = _cell(fraction if third_count > 1 else np.zeros(len(x)), third_count)
        next_k = min(1, third_count - 1)
        corners = [(k + (d & next_k), i + (e >> 1), j + (e & 1)) for d in (0, 1) for e in range(4)]
        c = np.array([self.log_colours[corner] for corner in corners])
        u, v, w = u[:, None], v[:, None], w[:, None]
        along_q = c[1::2] - c[0::2]
        rows = c[0::2] + v * along_q  # by third unknown and melanin
        layers = rows[0::2] + u * (rows[1::2] - rows[0::2])
        by_p = _lerp(rows[1::2] - rows[0::2], w) * (nodes - 1)
        by_q = _lerp(along_q[0::2] + u * (along_q[1::2] - along_q[0::2]), w) * (nodes - 1)
        by_t = (layers[1] - layers[0]) * max(third_count - 1, 1) / (high - low)
        result = _lerp(layers, w)
        if self.third == "shade":
            result, by_t = result + x[:, 2:], np.ones_like(result)
        return result, np.stack([by_p, by_q, by_t], axis=-1)

    def colours(self, melanin: Floats, blood: Floats, third: Floats | float | None = None) -> Floats:
        """Return (t, 3) diffuse reflectances, linear Rec. 709, for fractions (t,) of melanin and blood."""
        last = np.broadcast_to(self.prior_mean if third is None else third, np.shape(melanin))
        x = np.stack([np.sqrt(melanin), np.sqrt(blood), last], axis=-1)
        return np.asarray(np.exp(self.evaluate(x)[0]))


def _cell(fraction: Floats, nodes: int) -> tuple[NDArray[np.int64], Floats]:
    """Return the node below each position in [0, 1], and the position between it and the next node."""
    position = np.clip(fraction, 0.0, 1.0) * (nodes - 1)
    node = np.clip(position.astype(np.int64), 0, max(nodes - 2, 0))
    return node, position - node


def _lerp(pair: Floats, fraction: Floats) -> Floats:
    return np.asarray(pair[0] + fraction * (pair[1] - pair[0]))


def skin_model(skin: SkinParameters = DEFAULT_SKIN, third: ThirdUnknown = "none") -> SkinModel:
    """Return the model of all skins like this one, by layered diffusion.

    skin : parameters that are not varied; its own melanin and blood are ignored
    third : unknown besides melanin and blood; "none" keeps the skin's own oxygenation

    Raises DermisError for other names of the third unknown.
    """
    if third not in get_args(ThirdUnknown):
        refuse("third", ", ".join(get_args(ThirdUnknown)), f"got {format_value(third)}", "Take one of them")
    return _model(replace(skin, melanin=0.0, blood=0.0, epidermal_blood=0.0), third)


@lru_cache(maxsize=8)
def _model(skin: SkinParameters, third: ThirdUnknown) -> SkinModel:
    if third == "oxygen":
        oxygens = np.linspace(0.0, 1.0, _OXYGEN_COUNT)
        return SkinModel(_log_table(skin, oxygens), third, (0.0, 1.0), skin.oxygen, _OXYGEN_SD)
    logs = _log_table(skin, [skin.oxygen])
    if third == "shade":
        return SkinModel(logs, third, _SHADE_RANGE, 0.0, _SHADE_SD)
    return SkinModel(logs, third, (-1.0, 1.0), 0.0, _FIXED_SD)


def _log_table(skin: SkinParameters, oxygens: Floats | list[float]) -> Floats:
    tables = [colour_table(replace(skin, oxygen=float(one)), _NODES).colours for one in oxygens]
    return np.log(np.maximum(np.stack(tables), MIN_REFLECTANCE))


MAX_STEPS = 40  # colours of skin take four to six
_TOLERANCE = 1e-10
_MIN_CURVATURE = 1e-9  # added to curvatures, for nodes where an unknown has no effect
COLOUR_FLOOR = 2e-4
"""Absolute standard deviation of colours: half a step of 8-bit sRGB near black, in linear light [-]."""


@dataclass(frozen=True, eq=False)
class PigmentEstimate:
    """Estimated pigments of t colours.

    melanin, blood : (t,) volume fractions [-]
    third : (t,) third unknown of the model
    melanin_sd, blood_sd : (t,) lower bounds of the standard deviations due to noise, by the Cramér-Rao bound
        with the priors of blood and of the third unknown [-]
    residual : (t, 3) colour over that of the model
    """

    melanin: Floats
    blood: Floats
    third: Floats
    melanin_sd: Floats
    blood_sd: Floats
    residual: Floats


def inverse_variances(colours: Floats, noise: float) -> Floats:
    """Return (t, 3) inverse variances of the logarithms of colours."""
    return np.asarray(1.0 / (noise**2 + (COLOUR_FLOOR / np.maximum(colours, MIN_REFLECTANCE)) ** 2))


def solve_pigments(
    model: SkinModel, colours: Floats, noise: float = 0.01, start: Floats | None = None
) -> PigmentEstimate:
    """Return the most probable melanin, blood and third unknown of colours, in float64.

    The cost is the sum of squared differences of logarithms over their variances, and of squared deviations
    from the priors of blood and of the third unknown. It is minimised by Gauss-Newton steps with Levenberg's
    damping; unknowns at a limit are fixed there.

    colours : (t, 3) diffuse reflectance, linear Rec. 709
    noise : relative standard deviation of a channel [-]
    start : (t, 3) initial guess of the unknowns; None for a search
    """
    logs = np.log(np.maximum(colours, MIN_REFLECTANCE))
    weights = inverse_variances(colours, noise)
    x = _initial_guess(model, logs) if start is None else start.copy()
    damping = np.full(len(x), 1e-3)
    cost = _cost(model, x, logs, weights)
    for _ in range(MAX_STEPS):
        step = _damped_step(model, x, logs, weights, damping)
        trial = _clipped(model, x + step)
        trial_cost = _cost(model, trial, logs, weights)
        better = trial_cost <= cost
        x[better], cost = trial[better], np.minimum(cost, trial_cost)
        damping = np.where(better, 0.2 * damping, 8.0 * damping)
        if np.max(np.abs(step[better]), initial=0.0) < _TOLERANCE:
            break
    return _estimate(model, x, logs, weights)


def _initial_guess(model: SkinModel, logs: Floats) -> Floats:
    """Return the unknowns of the nearest colour on a coarse grid."""
    from scipy.spatial import cKDTree

    roots = np.linspace(0.0, 1.0, 65)
    x = np.stack(np.meshgrid(roots, roots, [model.prior_mean], indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = cKDTree(model.evaluate(x)[0]).query(logs)[1]
    return np.asarray(x[nearest])


def _cost(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> Floats:
    residual_cost = weights * (logs - model.evaluate(x)[0]) ** 2
    blood_cost = ((x[:, 1] - BLOOD_ROOT_MEAN) / BLOOD_ROOT_SD) ** 2
    third_cost = ((x[:, 2] - model.prior_mean) / model.prior_sd) ** 2
    return np.asarray(residual_cost.sum(axis=1) + (blood_cost + third_cost))


def _clipped(model: SkinModel, x: Floats) -> Floats:
    return np.clip(x, (0.0, 0.0, model.third_range[0]), (1.0, 1.0, model.third_range[1]))


def _damped_step(model: SkinModel, x: Floats, logs: Floats, weights: Floats, damping: Floats) -> Floats:
    """Return a damped step of each estimate; unknowns at a limit are fixed."""
    H, g = _normal_equations(model, x, logs, weights)
    diagonal = np.einsum("tii->ti", H)
    diagonal *= 1.0 + damping[:, None]
    step = np.linalg.solve(H, g[..., None])[..., 0]
    at_limit = (x + step != _clipped(model, x + step)) & (_clipped(model, x + 1e-12 * np.sign(step)) == x)
    H = np.where(at_limit[:, :, None] | at_limit[:, None, :], np.eye(3), H)
    step = np.linalg.solve(H, np.where(at_limit, 0.0, g)[..., None])[..., 0]
    return np.asarray(np.where(at_limit, 0.0, step))


def _normal_equations(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return the curvature (t, 3, 3) and the negative gradient (t, 3) of half the cost."""
    result, J = model.evaluate(x)
    weighted = weights[:, :, None] * J
    H = np.einsum("tci,tcj->tij", weighted, J)
    g = np.einsum("tci,tc->ti", weighted, logs - result)
    H[:, [0, 1], [0, 1]] += _MIN_CURVATURE
    H[:, 1, 1] += BLOOD_ROOT_SD**-2
    g[:, 1] -= (x[:, 1] - BLOOD_ROOT_MEAN) / BLOOD_ROOT_SD**2
    H[:, 2, 2] += model.prior_sd**-2
    g[:, 2] -= (x[:, 2] - model.prior_mean) / model.prior_sd**2
    return H, g


def _estimate(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> PigmentEstimate:
    covariance = np.linalg.inv(_normal_equations(model, x, logs, weights)[0])
    p, q = x[:, 0], x[:, 1]
    sd = np.sqrt(np.maximum(np.einsum("tii->ti", covariance)[:, :2], 0.0))
    residual = np.exp(logs - model.evaluate(x)[0])
    # A fraction is the square of its root r: its standard deviation is 2 r sd + sd^2.
    melanin_sd, blood_sd = (2.0 * root * one + one**2 for root, one in zip((p, q), sd.T, strict=True))
    return PigmentEstimate(p**2, q**2, x[:, 2], melanin_sd, blood_sd, residual)
