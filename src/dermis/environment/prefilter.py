"""A panorama as the frame reads it: irradiance by normal, and reflections in ever rougher mirrors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.environment.harmonics import analyse, synthesise, zonal
from dermis.environment.panorama import Sun, load_panorama, split_suns
from dermis.preparing import preparing
from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS, Lobe

Floats = NDArray[np.float64]
SIDE = 8
SMOOTHEST, ROUGHEST = 0.05, 1.0
_NODES = (192, 96)  # of the quadrature over polar angle and azimuth
_LEAST_COSINE = 0.02
ROUGHNESSES = np.geomspace(SMOOTHEST, ROUGHEST, 10)
"""Of the reflections' layers, even in the logarithm, between which the shader interpolates."""
HEIGHT = 128
_DEGREE = 96  # the smoothest lobe multiplies this degree by 1e-10: no ringing around lamps


def round_lobe(theta: Floats, m: float) -> Floats:
    """Weight of light at an angle from the mirror direction, seen along the normal [1/sr, up to a factor].

    theta : [rad], 0 to pi / 2
    m : roughness [-]

    The Kelemen lobe with n = v = r [Karis2013]: the half vector is at theta / 2, and h.h is
    4 cos^2(theta / 2).
    """
    half = np.cos(0.5 * theta)
    with np.errstate(under="ignore"):
        return np.asarray(beckmann(half, m) * np.cos(theta) / half**2)


@cache
def equivalent_mirrors(model: str = "kelemen") -> Floats:
    """(8, 8, 3) by roughness and view: sine and cosine of where the lobe points, and its roughness.

    model : name in MODELS

    Rows are even in the logarithm of the roughness from 0.05 to 1, columns in the view's cosine. Towards
    grazing views a lobe leaves the mirror direction and gets narrower; the round lobe that stands for it has
    the same mean direction and the same mean cosine about it.
    """
    table = np.empty((SIDE, SIDE, 3))
    spread, known = _spreads()
    for row, m in enumerate(np.geomspace(SMOOTHEST, ROUGHEST, SIDE)):
        for column, cosine in enumerate(np.linspace(0.0, 1.0, SIDE)):
            across, along = _mean_direction(MODELS[model].lobe, max(float(cosine), _LEAST_COSINE), float(m))
            length = np.hypot(across, along)
            table[row, column] = across / length, along / length, np.interp(-length, -spread, known)
    return table


def _mean_direction(lobe: Lobe, cosine: float, m: float) -> tuple[float, float]:
    """Mean of the directions of reflected light: along the surface away from the view, and the normal."""
    theta = 0.5 * np.pi * ((np.arange(_NODES[0]) + 0.5) / _NODES[0])[:, None]
    phi = np.pi * ((np.arange(_NODES[1]) + 0.5) / _NODES[1])[None, :]
    light = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) * np.ones_like(phi)], axis=-1
    )
    view = np.array([-np.sqrt(1.0 - cosine**2), 0.0, cosine])
    with np.errstate(under="ignore"):
        weight = lobe(cosines(np.array([0.0, 0.0, 1.0]), light, view), m) * light[..., 2] * np.sin(theta)
    x, _, z = (weight[..., None] * light).sum(axis=(0, 1)) / weight.sum()
    return float(x), float(z)


def _spreads() -> tuple[Floats, Floats]:
    """Mean cosine of round lobes about their own direction, and their roughness."""
    theta = 0.5 * np.pi * (np.arange(2048) + 0.5) / 2048
    roughness = np.geomspace(SMOOTHEST, ROUGHEST, 40)
    weights = [round_lobe(theta, float(m)) * np.sin(theta) for m in roughness]
    return np.array([(w * np.cos(theta)).sum() / w.sum() for w in weights]), roughness


@dataclass(frozen=True)
class Prefiltered:
    """A panorama, prefiltered.

    layers : (11, h, 2 h, 3) float32: irradiance by normal, then mean radiance by mirror direction
    suns : its peaks, which the layers leave out
    """

    layers: NDArray[np.float32]
    suns: tuple[Sun, ...]


@preparing("filtering the environment")
def prefilter(name: str) -> Prefiltered:
    """A panorama's layers and suns. It takes a quarter of a second, so nothing is kept on disk.

    name : as for `load_panorama`

    Each layer is the panorama convolved with a round kernel, exactly, in spherical harmonics of degree 96:
    no samples are drawn, so lamps leave no fireflies.

    Sources: [KautzMcCool2000] for reflections by roughness, [RamamoorthiHanrahan2001] for irradiance.
    """
    radiance, suns = split_suns(load_panorama(name))
    coefficients = analyse(radiance, _DEGREE)
    kernels = [zonal(np.cos, _DEGREE), *(mirror_kernel(float(m)) for m in ROUGHNESSES)]
    layers = [synthesise(coefficients, factors, HEIGHT) for factors in kernels]
    return Prefiltered(np.maximum(layers, 0.0).astype(np.float32), tuple(suns))


def mirror_kernel(m: float) -> Floats:
    """(97,) factors of the round lobe of roughness m, with the sum 1 over the sphere."""
    factors = zonal(lambda theta: round_lobe(theta, m), _DEGREE)
    return np.asarray(factors / factors[0])
