"""Skin colours by melanin, blood and a third number, and the inverse by least squares in float64."""

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
"""What darker colours are taken for: no skin is [-]."""
BLOOD_ROOT_MEAN, BLOOD_ROOT_SD = 0.1, 0.1
"""What the root of the share of blood is believed to be, mean and standard deviation: it decides where
melanin hides the blood, and nowhere else.
"""
_NODES = 129  # along melanin and along blood
_OXYGEN_COUNT = 5
_OXYGEN_SD, _SHADE_SD, _FIXED_SD = 0.1, 0.3, 1e-3
_SHADE_RANGE = -3.0, 1.5  # logarithms


@dataclass(frozen=True, eq=False)
class SkinModel:
    """Colours of skins that differ in melanin, blood and a third number.

    logs : (k, n, n, 3) logarithms of diffuse reflectance in linear Rec. 709, at the squares of n evenly
        spaced numbers from 0 to 1 of melanin and blood, and at k evenly spaced ones of oxygen
    third : oxygen is the share of haemoglobin that carries it; shade is the logarithm of a factor on all
        three channels, as light that was not even leaves it in a photograph
    span : of the third number
    usual, spread : mean and standard deviation of what it is believed to be, before any colour is seen
    """

    logs: Floats
    third: ThirdUnknown
    span: tuple[float, float]
    usual: float
    spread: float

    def read(self, x: Floats) -> tuple[Floats, Floats]:
        """Logarithms (t, 3) of the colours at roots of melanin and blood and a third number (t, 3), and their
        derivatives (t, 3, 3), channels first. Between nodes all is linear.
        """
        thirds, nodes = len(self.logs), self.logs.shape[1]
        i, u = _cell(x[:, 0], nodes)
        j, v = _cell(x[:, 1], nodes)
        share = (x[:, 2] - self.span[0]) / (self.span[1] - self.span[0])
        k, w = _cell(share if thirds > 1 else np.zeros(len(x)), thirds)
        far = min(1, thirds - 1)
        c = np.array([self.logs[k + (d & far), i + (e >> 1), j + (e & 1)] for d in (0, 1) for e in range(4)])
        near, across, both = c[0::2], c[1::2], v[:, None]
        rows = near + both * (across - near)  # by third and melanin
        along_q = across - near
        u, w = u[:, None], w[:, None]
        faces = rows[0::2] + u * (rows[1::2] - rows[0::2])
        by_p = _lerp(rows[1::2] - rows[0::2], w) * (nodes - 1)
        by_q = _lerp(along_q[0::2] + u * (along_q[1::2] - along_q[0::2]), w) * (nodes - 1)
        by_t = (faces[1] - faces[0]) * max(thirds - 1, 1) / (self.span[1] - self.span[0])
        found = _lerp(faces, w)
        if self.third == "shade":
            found, by_t = found + x[:, 2:], np.ones_like(found)
        return found, np.stack([by_p, by_q, by_t], axis=-1)

    def colours(self, melanin: Floats, blood: Floats, third: Floats | float | None = None) -> Floats:
        """(t, 3) diffuse reflectance, linear Rec. 709, of shares (t,) of melanin and blood [-]."""
        last = np.broadcast_to(self.usual if third is None else third, np.shape(melanin))
        x = np.stack([np.sqrt(melanin), np.sqrt(blood), last], axis=-1)
        return np.asarray(np.exp(self.read(x)[0]))


def _cell(share: Floats, nodes: int) -> tuple[NDArray[np.int64], Floats]:
    """The node before each share, and how far it is to the next."""
    place = np.clip(share, 0.0, 1.0) * (nodes - 1)
    before = np.clip(place.astype(np.int64), 0, max(nodes - 2, 0))
    return before, place - before


def _lerp(pair: Floats, share: Floats) -> Floats:
    return np.asarray(pair[0] + share * (pair[1] - pair[0]))


def skin_model(skin: SkinParameters = DEFAULT_SKIN, third: ThirdUnknown = "none") -> SkinModel:
    """The colours of all skins like this one, by layered diffusion; its own melanin and blood are ignored.

    third : what colour is to tell beside melanin and blood; "none" holds the skin's own oxygen

    Raises DermisError for another third.
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


MAX_STEPS = 40  # at most; colours of skin take four to six
_TOLERANCE = 1e-10
_MIN_CURVATURE = 1e-9  # added to curvatures, for nodes where a number does not show
COLOUR_FLOOR = 2e-4
"""Half a step of 8-bit sRGB near black, which no colour is known better than, in linear light [-]."""


@dataclass(frozen=True, eq=False)
class PigmentEstimate:
    """What a colour is made of, for each of t colours.

    melanin, blood : (t,) shares of volume [-]
    third : (t,) the model's third number
    melanin_sd, blood_sd : (t,) standard deviations that noise of the stated size must leave at least, by the
        Cramér-Rao bound with what is believed of blood and the third number [-]
    residual : (t, 3) the colour over that of the model
    """

    melanin: Floats
    blood: Floats
    third: Floats
    melanin_sd: Floats
    blood_sd: Floats
    residual: Floats


def inverse_variances(colours: Floats, noise: float) -> Floats:
    """(t, 3) one over the variance of each colour's logarithm."""
    return np.asarray(1.0 / (noise**2 + (COLOUR_FLOOR / np.maximum(colours, MIN_REFLECTANCE)) ** 2))


def solve_pigments(model: SkinModel, colours: Floats, noise: float = 0.01, start: Floats | None = None) -> PigmentEstimate:
    """Melanin, blood and the third number of greatest probability, in float64.

    colours : (t, 3) diffuse reflectance, linear Rec. 709
    noise : standard deviation of a channel, relative [-]
    start : (t, 3) first guess of the unknowns, found when left out

    The logarithms' squared differences over their variances, and those of blood and the third number from
    what is usual, are made least by Gauss and Newton's steps, damped by Levenberg's rule; numbers at a limit
    are held there.
    """
    logs = np.log(np.maximum(colours, MIN_REFLECTANCE))
    weights = inverse_variances(colours, noise)
    x = _initial_guess(model, logs) if start is None else start.copy()
    damping = np.full(len(x), 1e-3)
    cost = _cost(model, x, logs, weights)
    for _ in range(MAX_STEPS):
        step = _damped_step(model, x, logs, weights, damping)
        trial = _clipped(model, x + step)
        there = _cost(model, trial, logs, weights)
        better = there <= cost
        x[better], cost = trial[better], np.minimum(cost, there)
        damping = np.where(better, 0.2 * damping, 8.0 * damping)
        if np.max(np.abs(step[better]), initial=0.0) < _TOLERANCE:
            break
    return _estimate(model, x, logs, weights)


def _initial_guess(model: SkinModel, logs: Floats) -> Floats:
    """The nearest of a coarse grid of usual skins."""
    from scipy.spatial import cKDTree

    roots = np.linspace(0.0, 1.0, 65)
    x = np.stack(np.meshgrid(roots, roots, [model.usual], indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = cKDTree(model.read(x)[0]).query(logs)[1]
    return np.asarray(x[nearest])


def _cost(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> Floats:
    fault = weights * (logs - model.read(x)[0]) ** 2
    believed = ((x[:, 1] - BLOOD_ROOT_MEAN) / BLOOD_ROOT_SD) ** 2 + ((x[:, 2] - model.usual) / model.spread) ** 2
    return np.asarray(fault.sum(axis=1) + believed)


def _clipped(model: SkinModel, x: Floats) -> Floats:
    return np.clip(x, (0.0, 0.0, model.span[0]), (1.0, 1.0, model.span[1]))


def _damped_step(model: SkinModel, x: Floats, logs: Floats, weights: Floats, damping: Floats) -> Floats:
    """A step of each estimate; a number at a limit is held there, and the others go on without it."""
    H, g = _normal_equations(model, x, logs, weights)
    diagonal = np.einsum("tii->ti", H)
    diagonal *= 1.0 + damping[:, None]
    step = np.linalg.solve(H, g[..., None])[..., 0]
    held = (x + step != _clipped(model, x + step)) & (_clipped(model, x + 1e-12 * np.sign(step)) == x)
    H = np.where(held[:, :, None] | held[:, None, :], np.eye(3), H)
    step = np.linalg.solve(H, np.where(held, 0.0, g)[..., None])[..., 0]
    return np.asarray(np.where(held, 0.0, step))


def _normal_equations(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Curvature (t, 3, 3) and downward slope (t, 3) of half the cost."""
    found, J = model.read(x)
    weighed = weights[:, :, None] * J
    H = np.einsum("tci,tcj->tij", weighed, J)
    g = np.einsum("tci,tc->ti", weighed, logs - found)
    H[:, [0, 1], [0, 1]] += _MIN_CURVATURE
    H[:, 1, 1] += BLOOD_ROOT_SD**-2
    g[:, 1] -= (x[:, 1] - BLOOD_ROOT_MEAN) / BLOOD_ROOT_SD**2
    H[:, 2, 2] += model.spread**-2
    g[:, 2] -= (x[:, 2] - model.usual) / model.spread**2
    return H, g


def _estimate(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> PigmentEstimate:
    covariance = np.linalg.inv(_normal_equations(model, x, logs, weights)[0])
    p, q = x[:, 0], x[:, 1]
    sd = np.sqrt(np.maximum(np.einsum("tii->ti", covariance)[:, :2], 0.0))
    residual = np.exp(logs - model.read(x)[0])
    # A share is the square of its root: its deviation is twice the root times the root's, and that squared.
    melanin_sd, blood_sd = (2.0 * root * one + one**2 for root, one in zip((p, q), sd.T, strict=True))
    return PigmentEstimate(p**2, q**2, x[:, 2], melanin_sd, blood_sd, residual)
