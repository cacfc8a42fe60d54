"""Lobes as a few round ones: what prefiltered panoramas can be asked for, at any angle of view."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.environment.prefilter import ROUGHEST, SMOOTHEST, round_lobe
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS, Lobe

Floats = NDArray[np.float64]
ROUGH, VIEWS, LOBES = 8, 16, 4
_NODES = (96, 48)  # of the quadrature over polar angle and azimuth
_LEAST_COSINE = 0.02
_BISECTIONS = 40
_WIDEST = 2.0  # times as far apart as the parts of the lobe that they stand for


def mirror_numbers() -> dict[str, float]:
    """Numbers that environment.wgsl fills in."""
    return {"mirror_rough": ROUGH, "mirror_views": VIEWS, "mirror_lobes": LOBES}


@cache
def equivalent_mirrors(model: str = "kelemen") -> Floats:
    """(8, 16, 4, 3) by roughness and view: sine and cosine of where round lobes point, and their roughness.

    model : name in MODELS

    Rows are even in the logarithm of the roughness from 0.05 to 1, columns in the root of the view's cosine.
    The mean of the four stands for the lobe. Towards grazing views a lobe leaves the mirror direction, and
    gets longer in the plane of view than across: each round lobe stands for a quarter of its light along that
    plane and is as wide as it is across, if that leaves the mean of their directions as long as the lobe's.
    """
    table = np.empty((ROUGH, VIEWS, LOBES, 3))
    light, area = _hemisphere()
    for row, m in enumerate(np.geomspace(SMOOTHEST, ROUGHEST, ROUGH)):
        for column, root in enumerate(np.linspace(0.0, 1.0, VIEWS)):
            cosine = max(float(root) ** 2, _LEAST_COSINE)
            weight = _reflected(MODELS[model].lobe, light, cosine, float(m)) * area
            table[row, column] = _round_lobes(light, weight / weight.sum())
    return table


def _hemisphere() -> tuple[Floats, Floats]:
    """(n, 3) directions on one side of the plane of view, and their areas up to a factor."""
    theta = 0.5 * np.pi * ((np.arange(_NODES[0]) + 0.5) / _NODES[0])[:, None]
    phi = np.pi * ((np.arange(_NODES[1]) + 0.5) / _NODES[1])[None, :]
    x, y, z = np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), np.repeat(np.sin(theta), _NODES[1])


def _reflected(lobe: Lobe, light: Floats, cosine: float, m: float) -> Floats:
    """Radiance towards the view by directions of light, up to a factor."""
    view = np.array([-np.sqrt(1.0 - cosine**2), 0.0, cosine])
    with np.errstate(under="ignore"):
        return np.asarray(lobe(cosines(np.array([0.0, 0.0, 1.0]), light, view), m) * light[:, 2])


def _round_lobes(light: Floats, weight: Floats) -> Floats:
    """(4, 3) sine, cosine and roughness of the round lobes that stand for weighted directions."""
    across, along, roughness = _shapes()
    angle = np.arctan2(light[:, 0], light[:, 2])
    order = np.argsort(angle, kind="stable")
    below = np.cumsum(weight[order]) - 0.5 * weight[order]
    part = np.empty(len(weight), np.intp)
    part[order] = np.minimum((LOBES * below).astype(np.intp), LOBES - 1)
    share = np.bincount(part, weight, LOBES)
    middles = np.bincount(part, weight * angle, LOBES) / share
    m = np.interp(np.bincount(part, weight * light[:, 1] ** 2, LOBES) / share, across, roughness)
    mean = weight @ light[:, [0, 2]]
    m = np.minimum(m, np.interp(-np.hypot(*mean), -along, roughness))  # wide tails do not shorten the mean
    angles = _apart(middles, np.interp(m, roughness, along) / LOBES, mean)
    return np.stack([np.sin(angles), np.cos(angles), m], axis=-1)


def _apart(middles: Floats, length: Floats, mean: Floats) -> Floats:
    """Angles of lobes as far apart, and turned so far, that their sum is the mean direction.

    length : of each one's own mean direction, over their number
    """
    low, high = 0.0, _WIDEST
    for _ in range(_BISECTIONS):
        times = 0.5 * (low + high)
        angles = middles.mean() + times * (middles - middles.mean())
        x, z = length @ np.sin(angles), length @ np.cos(angles)
        low, high = (times, high) if np.hypot(x, z) > np.hypot(*mean) else (low, times)
    return np.asarray(angles + np.arctan2(*mean) - np.arctan2(x, z))


@cache
def _shapes() -> tuple[Floats, Floats, Floats]:
    """Mean squared sine across and mean cosine of round lobes about their own direction; their roughness."""
    theta = 0.5 * np.pi * (np.arange(2048) + 0.5) / 2048
    roughness = np.geomspace(SMOOTHEST, ROUGHEST, 40)
    weights = np.array([round_lobe(theta, float(m)) * np.sin(theta) for m in roughness])
    weights /= weights.sum(axis=1, keepdims=True)
    return 0.5 * weights @ np.sin(theta) ** 2, weights @ np.cos(theta), roughness
