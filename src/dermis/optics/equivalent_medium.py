"""The medium that a profile stands for, and its lateral offset of oblique light."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from dermis.optics.curve import Curve
from dermis.optics.diffusion import hankel, layered_diffusion
from dermis.optics.diffusion.boundary import mismatch
from dermis.optics.directions import KEPT, interpolated
from dermis.optics.gaussians import GaussianSum
from dermis.optics.half_space import Kind, albedo_of, half_space, kind_under
from dermis.optics.media import Layer, Medium

Floats = NDArray[np.float64]
MOST_ALBEDO, LEAST_ALBEDO = 1.0 - 1e-6, 1e-3
_LOGS = (-14.0, 14.0)  # of frequencies that are searched [1/mm]
_ABSORBED = 0.35  # of absorption in the published length


def medium_of(profile: GaussianSum, total: Floats, eta: float) -> Medium:
    """The half-space that returns a share of light, and half of it within the profile's own distance.

    total : (c,) that it returns of what enters perpendicularly [-]
    eta : index of refraction against the air [-]
    """
    albedo, extinction = np.empty(len(total)), np.empty(len(total))
    for c, share in enumerate(total):
        root, half = interpolated(partial(_returning, eta, profile.counted), float(share))
        one = tuple(zip(profile.variance_mm2.tolist(), profile.weight[:, c].tolist(), strict=True))
        albedo[c], extinction[c] = 1.0 - root**2, _half(partial(_spread, one)) / half
    layer = Layer((1.0 - albedo) * extinction, albedo * extinction)
    return Medium("flesh", (layer,), eta)


@lru_cache(maxsize=KEPT)
def _returning(eta: float, counted: bool, total: float) -> Floats:
    """(2,) of the half-space that returns this share: the root of what a scattering absorbs [-], and the
    frequency at which what it returns has fallen to half [1/mean free path]; by photons or by diffusion, as
    the profile is: that of photons is narrower."""
    albedo, kind = albedo_of_total(total, eta, counted), _tables(eta, counted)
    if kind is None:
        return np.array([np.sqrt(1.0 - albedo), _half(partial(_returned, _unit(albedo, eta)))])
    curve = half_space(kind, np.full(3, albedo), np.ones(3))
    return np.array([np.sqrt(1.0 - albedo), _half(partial(_transform, curve))])


def _tables(eta: float, counted: bool) -> Kind | None:
    return kind_under(eta) if counted else None


def albedo_of_total(total: float, eta: float, counted: bool = False) -> float:
    """Albedo of single scattering of the half-space that returns a share of what enters perpendicularly [-].

    counted : by photons where tables have them, else by layered diffusion
    """
    from scipy.optimize import brentq

    kind = _tables(eta, counted)
    if kind is not None:
        return float(albedo_of(kind, total))

    def beyond(albedo: float) -> float:
        return _returned(_unit(albedo, eta), float(hankel.STILL[0])) - total

    if beyond(LEAST_ALBEDO) >= 0.0:
        return LEAST_ALBEDO
    return float(brentq(beyond, LEAST_ALBEDO, MOST_ALBEDO)) if beyond(MOST_ALBEDO) > 0.0 else MOST_ALBEDO


def _unit(albedo: float, eta: float) -> Medium:
    """A half-space whose mean free path is 1 mm."""
    return Medium("flesh", (Layer(np.array([1.0 - albedo]), np.array([albedo])),), eta)


def _spread(gaussians: tuple[tuple[float, float], ...], frequency: float) -> float:
    """`GaussianSum.hankel` of one channel, by its variances and weights; in plain floats, as they are few."""
    return sum(weight * math.exp(-0.5 * variance * frequency**2) for variance, weight in gaussians)


def _transform(curve: Curve, frequency: float) -> float:
    """Hankel transform of a curve's first channel, over its total."""
    from scipy.special import j0

    edges = curve.radii_mm
    middle = np.append(0.5 * edges[1], np.sqrt(edges[1:-1] * edges[2:]))
    return float(j0(frequency * middle) @ np.diff(curve.share[:, 0]))


def _returned(body: Medium, frequency: float) -> float:
    """Hankel transform of what it returns."""
    A = mismatch(body.eta, "exact")
    return float(layered_diffusion.reflect(np.array([frequency]), body, A)[0, 0])


def _half(transform: Callable[[float], float]) -> float:
    """The frequency at which a transform has fallen to half of its total [1/mm]."""
    from scipy.optimize import brentq

    total = transform(float(hankel.STILL[0]))
    return float(np.exp(brentq(lambda log: transform(float(np.exp(log))) - 0.5 * total, *_LOGS)))


def aside_mm(body: Medium) -> float:
    """How far from where it entered the middle of light lies that came along the surface, the channels' mean.

    body : of one layer

    Light from an angle lies its sine times that far from there, on along its way.

    Source: [WangJacques1995].
    """
    layer = body.layers[0]
    return float(np.mean(1.0 / (layer.sigma_s_prime + _ABSORBED * layer.sigma_a)) / body.eta)
