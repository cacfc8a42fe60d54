"""Melanin and blood of colours, in float64: what the device is checked against, and how it solves it too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.apps.inverse.unmixing.model import BLOOD_SPREAD, DARKEST, USUAL_BLOOD, SkinModel
from dermis.optics.media import Floats

STEPS = 40  # at most; colours of skin take four to six
_DONE = 1e-10
_CURVED = 1e-9  # added to curvatures, for nodes where a number does not show
FLOOR = 2e-4
"""Half a step of 8-bit sRGB near black, which no colour is known better than, in linear light [-]."""


@dataclass(frozen=True, eq=False)
class Estimate:
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


def weights_of(colours: Floats, noise: float) -> Floats:
    """(t, 3) one over the variance of each colour's logarithm."""
    return np.asarray(1.0 / (noise**2 + (FLOOR / np.maximum(colours, DARKEST)) ** 2))


def solve(model: SkinModel, colours: Floats, noise: float = 0.01, start: Floats | None = None) -> Estimate:
    """Melanin, blood and the third number of greatest probability, in float64.

    colours : (t, 3) diffuse reflectance, linear Rec. 709
    noise : standard deviation of a channel, relative [-]
    start : (t, 3) first guess of the unknowns, found when left out

    The logarithms' squared differences over their variances, and those of blood and the third number from
    what is usual, are made least by Gauss and Newton's steps, damped by Levenberg's rule; numbers at a limit
    are held there.
    """
    logs = np.log(np.maximum(colours, DARKEST))
    weights = weights_of(colours, noise)
    x = _start(model, logs) if start is None else start.copy()
    damping = np.full(len(x), 1e-3)
    cost = _cost(model, x, logs, weights)
    for _ in range(STEPS):
        step = _step(model, x, logs, weights, damping)
        trial = _limited(model, x + step)
        there = _cost(model, trial, logs, weights)
        better = there <= cost
        x[better], cost = trial[better], np.minimum(cost, there)
        damping = np.where(better, 0.2 * damping, 8.0 * damping)
        if np.max(np.abs(step[better]), initial=0.0) < _DONE:
            break
    return _estimate(model, x, logs, weights)


def _start(model: SkinModel, logs: Floats) -> Floats:
    """The nearest of a coarse grid of usual skins."""
    from scipy.spatial import cKDTree

    roots = np.linspace(0.0, 1.0, 65)
    x = np.stack(np.meshgrid(roots, roots, [model.usual], indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = cKDTree(model.read(x)[0]).query(logs)[1]
    return np.asarray(x[nearest])


def _cost(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> Floats:
    fault = weights * (logs - model.read(x)[0]) ** 2
    believed = ((x[:, 1] - USUAL_BLOOD) / BLOOD_SPREAD) ** 2 + ((x[:, 2] - model.usual) / model.spread) ** 2
    return np.asarray(fault.sum(axis=1) + believed)


def _limited(model: SkinModel, x: Floats) -> Floats:
    return np.clip(x, (0.0, 0.0, model.span[0]), (1.0, 1.0, model.span[1]))


def _step(model: SkinModel, x: Floats, logs: Floats, weights: Floats, damping: Floats) -> Floats:
    """A step of each estimate; a number at a limit is held there, and the others go on without it."""
    H, g = _system(model, x, logs, weights)
    diagonal = np.einsum("tii->ti", H)
    diagonal *= 1.0 + damping[:, None]
    step = np.linalg.solve(H, g[..., None])[..., 0]
    held = (x + step != _limited(model, x + step)) & (_limited(model, x + 1e-12 * np.sign(step)) == x)
    H = np.where(held[:, :, None] | held[:, None, :], np.eye(3), H)
    step = np.linalg.solve(H, np.where(held, 0.0, g)[..., None])[..., 0]
    return np.asarray(np.where(held, 0.0, step))


def _system(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Curvature (t, 3, 3) and downward slope (t, 3) of half the cost."""
    found, J = model.read(x)
    weighed = weights[:, :, None] * J
    H = np.einsum("tci,tcj->tij", weighed, J)
    g = np.einsum("tci,tc->ti", weighed, logs - found)
    H[:, [0, 1], [0, 1]] += _CURVED
    H[:, 1, 1] += BLOOD_SPREAD**-2
    g[:, 1] -= (x[:, 1] - USUAL_BLOOD) / BLOOD_SPREAD**2
    H[:, 2, 2] += model.spread**-2
    g[:, 2] -= (x[:, 2] - model.usual) / model.spread**2
    return H, g


def _estimate(model: SkinModel, x: Floats, logs: Floats, weights: Floats) -> Estimate:
    covariance = np.linalg.inv(_system(model, x, logs, weights)[0])
    p, q = x[:, 0], x[:, 1]
    sd = np.sqrt(np.maximum(np.einsum("tii->ti", covariance)[:, :2], 0.0))
    residual = np.exp(logs - model.read(x)[0])
    # A share is the square of its root: its deviation is twice the root times the root's, and that squared.
    melanin_sd, blood_sd = (2.0 * root * one + one**2 for root, one in zip((p, q), sd.T, strict=True))
    return Estimate(p**2, q**2, x[:, 2], melanin_sd, blood_sd, residual)
