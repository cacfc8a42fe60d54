"""Fits of what a target can show (a lobe, a medium, a curve of one shape) to a profile, and their errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.curve import Curve
from dermis.optics.fits.burley import BurleyProfile
from dermis.optics.half_space import Kind, albedo_of, half_space
from dermis.optics.media import Floats
from dermis.optics.radial import TINY

_BURLEY_MEDIAN = 1.58  # radius within which half of the light leaves, by d
_REACH = np.log(30.0)  # of sizes about the one of the same median
_HALVINGS, _MEDIUM_HALVINGS = 40, 30
_THINNEST_MM = 1e-9
_FARTHEST, _DISTANCES = 12.0, 97  # of an edge's distances, in median radii
_LEAST, _MOST, _NODES = 1e-2, 60.0, 400  # radii that a fit is judged at, by the true median
_KNOWN = np.geomspace(1e-4, 1e4, 2000)
_SPAN, _EXACT = 2.0, 1e-4  # logarithms of lengths: about the one of the same median, and the tolerance


def lobe(d_mm: ArrayLike, energy: ArrayLike) -> Curve:
    """Return the curve of Burley's lobe R(r) = A (exp(-r/d) + exp(-r/3d)) / (8 pi d r).

    d_mm : (3,) above 0 [mm]
    energy : (3,) A [-]
    """
    d = np.maximum(np.asarray(d_mm, np.float64), _THINNEST_MM)
    return Curve.of(BurleyProfile(np.ones(3), 1.0 / d).within, energy)


def fit_d(curve: Curve) -> Floats:
    """Return the widths d (3,) of the lobes with the least largest difference from a cumulative profile [mm].

    Least squares would weigh radii as they are spaced.
    """
    median = np.array([np.interp(0.5, curve.share[:, i], curve.radii_mm) for i in range(3)])
    middle = np.log(median / _BURLEY_MEDIAN)
    return _balanced(
        lambda d: BurleyProfile(np.ones(3), np.exp(-d)).within(curve.radii_mm) - curve.share,
        middle - _REACH,
        middle + _REACH,
        _HALVINGS,
    )


def gaussian_curve(variance_mm2: Floats, weight: Floats, energy: Floats) -> Curve:
    """Return the curve of a sum of Gaussians.

    variance_mm2, weight : (n,) [mm^2], (n, 3) [-]
    """
    share = weight / weight.sum(axis=0)

    def within(radius_mm: Floats) -> Floats:
        with np.errstate(under="ignore"):
            return np.asarray(1.0 - np.exp(-0.5 * radius_mm[:, None] ** 2 / variance_mm2) @ share)

    return Curve.of(within, energy)


def resized(unit: Curve, size_mm: ArrayLike) -> Curve:
    """Return a curve whose lengths are in a unit, with a unit (3,) for each channel."""
    size = np.maximum(np.asarray(size_mm, np.float64), _THINNEST_MM)

    def within(radius_mm: Floats) -> Floats:
        return np.stack([unit.within(radius_mm / size[i])[:, i] for i in range(3)], axis=-1)

    return Curve.of(within, unit.energy)


def nearest_size(curve: Curve, unit: Curve) -> Floats:
    """Return the units (3,) with the least largest difference from a curve [mm]."""
    middle = np.log(curve.radius_of(0.5) / unit.radius_of(0.5))
    return _nearest(curve, unit, middle, _REACH, _HALVINGS - 1)


@dataclass(frozen=True)
class Homogeneous:
    """A half-space of one medium with isotropic scattering.

    albedo : (3,) single-scattering albedo, reduced [-]
    mfp_mm : (3,) reduced mean free path [mm]
    curve : of the light that leaves it
    """

    albedo: Floats
    mfp_mm: Floats
    curve: Curve


def homogeneous(curve: Curve, energy: Floats | None = None, kind: Kind = "skin") -> Homogeneous:
    """Return the medium with a curve's energy whose cumulative profile is nearest to the curve.

    energy : (3,) total that it has instead, a colour's [-]
    kind : surface and light of the half-space
    """
    albedo = albedo_of(kind, curve.energy if energy is None else energy)
    unit = half_space(kind, albedo, np.ones(3))
    middle = np.log(fit_d(curve) / fit_d(unit))  # both are as wide as the same lobe
    mfp = _nearest(curve, unit, middle, 2.0, _MEDIUM_HALVINGS)
    return Homogeneous(albedo, mfp, half_space(kind, albedo, mfp))


def _nearest(curve: Curve, unit: Curve, middle: Floats, reach: float, halvings: int) -> Floats:
    return _balanced(
        lambda size: resized(unit, np.exp(size)).share - curve.share, middle - reach, middle + reach, halvings
    )


def _balanced(surplus: Callable[[Floats], Floats], low: Floats, high: Floats, halvings: int) -> Floats:
    """Return the sizes (3,) at which the largest surplus and the largest deficit of light are equal.

    A wider curve has less light within each radius, so that its largest surplus falls with the size and its
    largest deficit grows: where they are equal, the largest difference is least.

    surplus : (n, 3) of the light within some radii, by the logarithms of the sizes (3,)
    low, high : logarithms of the sizes (3,)
    """
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        over = surplus(middle)
        wider = over.max(axis=0) > -over.min(axis=0)
        low, high = np.where(wider, middle, low), np.where(wider, high, middle)
    return np.asarray(np.exp(0.5 * (low + high)))


def fit_length(curve: Curve, channel: int, within: Callable[[Floats], Floats]) -> float:
    """Return the length at which a cumulative profile is nearest to one channel's [mm].

    Least squares over log r.

    within : share of what leaves anywhere, within radii (n,) of a length of 1
    """
    from scipy.optimize import minimize_scalar

    median = float(curve.radius_of(0.5)[channel])
    r = median * np.geomspace(_LEAST, _MOST, _NODES)
    true = curve.within(r)[:, channel]
    middle = np.log(median / float(np.interp(0.5, within(_KNOWN), _KNOWN)))

    def error(length: float) -> float:
        return float(((within(r / np.exp(length)) - true) ** 2).sum())

    bounds = middle - _SPAN, middle + _SPAN
    found = minimize_scalar(error, bounds=bounds, method="bounded", options={"xatol": _EXACT})
    return float(np.exp(found.x))


@dataclass(frozen=True)
class Deviation:
    """Differences of a target's curve from the true one, in red, green and blue.

    cdf : (3,) largest difference of the share of light that leaves within a radius [-]
    edge : (3,) largest difference beside a straight edge of light, such as a shadow's [-]
    energy : (3,) relative error of all the light that leaves [-]
    """

    cdf: Floats
    edge: Floats
    energy: Floats

    def as_json(self) -> dict[str, list[float]]:
        """Return plain lists of three by name."""
        return {name: [round(float(x), 6) for x in getattr(self, name)] for name in ("cdf", "edge", "energy")}


def deviation(true: Curve, shown: Curve) -> Deviation:
    """Return how far a target's curve is from the true one."""
    steps = np.geomspace(1e-3, 1.0, _DISTANCES)
    widest = _FARTHEST * np.maximum(true.radius_of(0.5), shown.radius_of(0.5))
    edge = np.zeros(3)
    for i in range(3):
        x = widest[i] * steps
        edge[i] = np.abs(shown.edge(x) - true.edge(x))[:, i].max()
    return Deviation(
        cdf=np.abs(shown.within(true.radii_mm) - true.share).max(axis=0),
        edge=edge,
        energy=shown.energy / np.maximum(true.energy, TINY) - 1.0,
    )
