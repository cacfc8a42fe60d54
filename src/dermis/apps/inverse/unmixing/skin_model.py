"""Model of skin colour as a function of melanin, blood and an extra unknown, and its inversion in float64.

The extra unknown is the oxygenated fraction of haemoglobin or the shading; a model can also do without it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.pigments.priors import skin_prior
from dermis.optics.skin_colours import colour_table

ExtraUnknown = Literal["none", "oxygen", "shade"]
MIN_REFLECTANCE = 1e-4
"""Limit to which smaller reflectances are raised before their logarithm is taken; no skin is as dark [-]."""
BLOOD_ROOT_MEAN, BLOOD_ROOT_SD = 0.1, 0.1
"""Mean and standard deviation of the prior of the blood fraction's square root. The prior only matters where
melanin hides the blood."""
_TABLE_NODES_PER_AXIS = 129  # number of table nodes along melanin and along blood
_OXYGEN_NODE_COUNT = 5
_LOG_SHADE_SD, _FIXED_UNKNOWN_SD = 0.3, 1e-3
_LOG_SHADE_RANGE = -3.0, 1.5  # limits of the logarithm of the shading


@dataclass(frozen=True, eq=False)
class SkinModel:
    """Table of skin colours over melanin, blood and an extra unknown; colours are unmixed by inverting it.

    log_colours : (k, n, n, 3) logarithms of diffuse reflectance in linear Rec. 709. The axes are k oxygenated
        fractions, evenly spaced from 0 to 1 (k is 1 unless oxygen is the extra unknown); and n melanin and
        n blood fractions, whose square roots are evenly spaced from 0 to 1
    extra_unknown : "oxygen" is the oxygenated fraction of haemoglobin; "shade" is the logarithm of a
        factor common to all channels, such as uneven light in a photograph; "none" if there is none
    extra_range : smallest and largest value of the extra unknown
    prior_mean, prior_sd : mean and standard deviation of the extra unknown's prior
    """

    log_colours: Floats
    extra_unknown: ExtraUnknown
    extra_range: tuple[float, float]
    prior_mean: float
    prior_sd: float

    def evaluate(self, unknowns: Floats) -> tuple[Floats, Floats]:
        """Return the logarithms (t, 3) of the model's colours, and their derivatives (t, 3, 3).

        The second axis of the derivatives is the channel, and the third axis is the unknown. The table is
        interpolated linearly.

        unknowns : (t, 3) for each colour, the square root of the melanin fraction, the square root of the
            blood fraction, and the quantity that the field `extra_unknown` names (ignored if that is "none")
        """
        extra_node_count, nodes = len(self.log_colours), self.log_colours.shape[1]
        low, high = self.extra_range
        i, u = _grid_node_below(unknowns[:, 0], nodes)
        j, v = _grid_node_below(unknowns[:, 1], nodes)
        fraction = (unknowns[:, 2] - low) / (high - low)
        k, w = _grid_node_below(
            fraction if extra_node_count > 1 else np.zeros(len(unknowns)), extra_node_count
        )
        next_k = min(1, extra_node_count - 1)
        corners = [(k + (d & next_k), i + (e >> 1), j + (e & 1)) for d in (0, 1) for e in range(4)]
        c = np.array([self.log_colours[corner] for corner in corners])
        u, v, w = u[:, None], v[:, None], w[:, None]
        along_q = c[1::2] - c[0::2]
        rows = c[0::2] + v * along_q  # by extra unknown and melanin
        layers = rows[0::2] + u * (rows[1::2] - rows[0::2])
        by_p = _lerp(rows[1::2] - rows[0::2], w) * (nodes - 1)
        by_q = _lerp(along_q[0::2] + u * (along_q[1::2] - along_q[0::2]), w) * (nodes - 1)
        by_t = (layers[1] - layers[0]) * max(extra_node_count - 1, 1) / (high - low)
        result = _lerp(layers, w)
        if self.extra_unknown == "shade":
            result, by_t = result + unknowns[:, 2:], np.ones_like(result)
        return result, np.stack([by_p, by_q, by_t], axis=-1)

    def colours(self, melanin: Floats, blood: Floats, extra_value: Floats | float | None = None) -> Floats:
        """Return the diffuse reflectance (t, 3) of t skins, linear Rec. 709 [-].

        melanin, blood : (t,) volume fractions [-]
        extra_value : value of the quantity that the field `extra_unknown` names: an oxygenated fraction, or
            the logarithm of a shading; by default the mean of its prior [-]
        """
        last = np.broadcast_to(self.prior_mean if extra_value is None else extra_value, np.shape(melanin))
        x = np.stack([np.sqrt(melanin), np.sqrt(blood), last], axis=-1)
        return np.asarray(np.exp(self.evaluate(x)[0]))


def _grid_node_below(axis_fraction: Floats, node_count: int) -> tuple[NDArray[np.int64], Floats]:
    """Return the grid node below each position in [0, 1], and the position between this node and the next.

    The second result is 0 at the node below and 1 at the next node.
    """
    position = np.clip(axis_fraction, 0.0, 1.0) * (node_count - 1)
    node = np.clip(position.astype(np.int64), 0, max(node_count - 2, 0))
    return node, position - node


def _lerp(node_values: Floats, fraction: Floats) -> Floats:
    return np.asarray(node_values[0] + fraction * (node_values[1] - node_values[0]))


def skin_model(skin: SkinParameters = DEFAULT_SKIN, extra_unknown: ExtraUnknown = "none") -> SkinModel:
    """Return the skin model for all fractions of melanin and blood, computed by layered diffusion.

    skin : parameters that do not vary; its melanin and blood are ignored
    extra_unknown : unknown besides melanin and blood; "none" keeps the oxygenation of `skin`

    Raises DermisError for other names of the extra unknown.
    """
    if extra_unknown not in get_args(ExtraUnknown):
        refuse(
            "extra_unknown",
            ", ".join(get_args(ExtraUnknown)),
            f"got {format_value(extra_unknown)}",
            "Take one of them",
        )
    return _cached_skin_model(replace(skin, melanin=0.0, blood=0.0, epidermal_blood=0.0), extra_unknown)


@lru_cache(maxsize=8)
def _cached_skin_model(skin: SkinParameters, extra_unknown: ExtraUnknown) -> SkinModel:
    if extra_unknown == "oxygen":
        oxygens = np.linspace(0.0, 1.0, _OXYGEN_NODE_COUNT)
        sd = skin_prior().moments("oxygen")[1]
        return SkinModel(_log_colour_tables(skin, oxygens), extra_unknown, (0.0, 1.0), skin.oxygen, sd)
    logs = _log_colour_tables(skin, [skin.oxygen])
    if extra_unknown == "shade":
        return SkinModel(logs, extra_unknown, _LOG_SHADE_RANGE, 0.0, _LOG_SHADE_SD)
    return SkinModel(logs, extra_unknown, (-1.0, 1.0), 0.0, _FIXED_UNKNOWN_SD)


def _log_colour_tables(skin: SkinParameters, oxygen_fractions: Floats | list[float]) -> Floats:
    tables = [
        colour_table(replace(skin, oxygen=float(one)), _TABLE_NODES_PER_AXIS).colours
        for one in oxygen_fractions
    ]
    return np.log(np.maximum(np.stack(tables), MIN_REFLECTANCE))


MAX_STEPS = 40  # colours of skin need four to six steps
_STEP_TOLERANCE = 1e-10
_MIN_CURVATURE = 1e-9  # added to curvatures, for nodes where an unknown has no effect
COLOUR_FLOOR = 2e-4
"""Part of a colour's standard deviation that is equal for all colours: half a step of 8-bit sRGB near black,
in linear light [-]."""


@dataclass(frozen=True, eq=False)
class PigmentEstimate:
    """Pigments estimated from t colours.

    melanin, blood : (t,) volume fractions [-]
    extra_value : (t,) quantity that `SkinModel.extra_unknown` names: the oxygenated fraction of haemoglobin,
        or the logarithm of the shading; without meaning if that is "none" [-]
    melanin_sd, blood_sd : (t,) lower bounds of the standard deviations due to noise: the Cramér-Rao bound,
        which includes the priors of blood and of the extra unknown [-]
    residual : (t, 3) colour divided by the model's colour [-]
    """

    melanin: Floats
    blood: Floats
    extra_value: Floats
    melanin_sd: Floats
    blood_sd: Floats
    residual: Floats


def inverse_variances(colours: Floats, relative_noise: float) -> Floats:
    """Return the inverse variance (t, 3) of the logarithm of each channel of noisy colours.

    colours : (t, 3) diffuse reflectance, linear Rec. 709 [-]
    relative_noise : relative standard deviation of a channel [-]
    """
    return np.asarray(1.0 / (relative_noise**2 + (COLOUR_FLOOR / np.maximum(colours, MIN_REFLECTANCE)) ** 2))


def solve_pigments(
    model: SkinModel, colours: Floats, relative_noise: float = 0.01, start: Floats | None = None
) -> PigmentEstimate:
    """Return the most probable melanin and blood of each colour, computed in float64.

    If the model has an extra unknown (oxygen or shading, see `SkinModel`), it is estimated too.

    The cost is a sum of squares, each divided by its variance: the difference between the logarithms of the
    given and the model's colour in each channel, and the deviations of blood and of the extra unknown from
    their prior means. It is minimised by Gauss-Newton steps with Levenberg's damping. An unknown at a limit
    stays fixed if the step would cross the limit.

    colours : (t, 3) diffuse reflectance, linear Rec. 709 [-]
    relative_noise : relative standard deviation of a channel [-]
    start : (t, 3) unknowns to start from, as in `SkinModel.evaluate`; None for a search on a coarse grid
    """
    logs = np.log(np.maximum(colours, MIN_REFLECTANCE))
    weights = inverse_variances(colours, relative_noise)
    x = _initial_guess(model, logs) if start is None else start.copy()
    damping = np.full(len(x), 1e-3)
    cost = _fit_cost(model, x, logs, weights)
    for _ in range(MAX_STEPS):
        step = _damped_step(model, x, logs, weights, damping)
        trial = _clip_unknowns(model, x + step)
        trial_cost = _fit_cost(model, trial, logs, weights)
        better = trial_cost <= cost
        x[better], cost = trial[better], np.minimum(cost, trial_cost)
        damping = np.where(better, 0.2 * damping, 8.0 * damping)
        if np.max(np.abs(step[better]), initial=0.0) < _STEP_TOLERANCE:
            break
    return _pigment_estimate(model, x, logs, weights)


def _initial_guess(model: SkinModel, log_colours: Floats) -> Floats:
    """Return for each colour the unknowns (t, 3) of the skin with the nearest colour on a coarse grid.

    log_colours : (t, 3) logarithms of the colours
    """
    from scipy.spatial import cKDTree

    roots = np.linspace(0.0, 1.0, 65)
    x = np.stack(np.meshgrid(roots, roots, [model.prior_mean], indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = cKDTree(model.evaluate(x)[0]).query(log_colours)[1]
    return np.asarray(x[nearest])


def _fit_cost(model: SkinModel, unknowns: Floats, log_colours: Floats, colour_weights: Floats) -> Floats:
    residual_cost = colour_weights * (log_colours - model.evaluate(unknowns)[0]) ** 2
    blood_cost = ((unknowns[:, 1] - BLOOD_ROOT_MEAN) / BLOOD_ROOT_SD) ** 2
    extra_cost = ((unknowns[:, 2] - model.prior_mean) / model.prior_sd) ** 2
    return np.asarray(residual_cost.sum(axis=1) + (blood_cost + extra_cost))


def _clip_unknowns(model: SkinModel, unknowns: Floats) -> Floats:
    return np.clip(unknowns, (0.0, 0.0, model.extra_range[0]), (1.0, 1.0, model.extra_range[1]))


def _damped_step(
    model: SkinModel, unknowns: Floats, log_colours: Floats, colour_weights: Floats, damping: Floats
) -> Floats:
    """Return the damped Gauss-Newton step (t, 3) of each colour's unknowns.

    The step is 0 for an unknown at a limit that it would cross.

    unknowns : (t, 3) unknowns before the step, as in `SkinModel.evaluate`
    log_colours : (t, 3) logarithms of the given colours
    colour_weights : (t, 3) inverse variances of these logarithms
    damping : (t,) damping factor of each colour
    """
    H, g = _normal_equations(model, unknowns, log_colours, colour_weights)
    diagonal = np.einsum("tii->ti", H)
    diagonal *= 1.0 + damping[:, None]
    step = np.linalg.solve(H, g[..., None])[..., 0]
    at_limit = (unknowns + step != _clip_unknowns(model, unknowns + step)) & (
        _clip_unknowns(model, unknowns + 1e-12 * np.sign(step)) == unknowns
    )
    H = np.where(at_limit[:, :, None] | at_limit[:, None, :], np.eye(3), H)
    step = np.linalg.solve(H, np.where(at_limit, 0.0, g)[..., None])[..., 0]
    return np.asarray(np.where(at_limit, 0.0, step))


def _normal_equations(
    model: SkinModel, unknowns: Floats, log_colours: Floats, colour_weights: Floats
) -> tuple[Floats, Floats]:
    """Return the Gauss-Newton matrix (t, 3, 3) and the negative gradient (t, 3) of half the cost.

    The cost is that of `solve_pigments`; the arguments are those of `_damped_step`.
    """
    result, J = model.evaluate(unknowns)
    weighted = colour_weights[:, :, None] * J
    H = np.einsum("tci,tcj->tij", weighted, J)
    g = np.einsum("tci,tc->ti", weighted, log_colours - result)
    H[:, [0, 1], [0, 1]] += _MIN_CURVATURE
    H[:, 1, 1] += BLOOD_ROOT_SD**-2
    g[:, 1] -= (unknowns[:, 1] - BLOOD_ROOT_MEAN) / BLOOD_ROOT_SD**2
    H[:, 2, 2] += model.prior_sd**-2
    g[:, 2] -= (unknowns[:, 2] - model.prior_mean) / model.prior_sd**2
    return H, g


def _pigment_estimate(
    model: SkinModel, unknowns: Floats, log_colours: Floats, colour_weights: Floats
) -> PigmentEstimate:
    covariance = np.linalg.inv(_normal_equations(model, unknowns, log_colours, colour_weights)[0])
    p, q = unknowns[:, 0], unknowns[:, 1]
    sd = np.sqrt(np.maximum(np.einsum("tii->ti", covariance)[:, :2], 0.0))
    residual = np.exp(log_colours - model.evaluate(unknowns)[0])
    # A fraction is the square of its root r: its standard deviation is 2 r sd + sd^2.
    melanin_sd, blood_sd = (2.0 * root * one + one**2 for root, one in zip((p, q), sd.T, strict=True))
    return PigmentEstimate(p**2, q**2, unknowns[:, 2], melanin_sd, blood_sd, residual)
