"""Burley's lobe R(r) = A (exp(-r/d) + exp(-r/3d)) / (8 pi d r), which most engines have, and its fit."""

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

_HALF = 1.58  # radius within which half of the light leaves, by d
_FACTOR = 30.0  # between the width that fits the median alone and any that is tried
_HALVINGS = 40
_THINNEST_MM = 1e-9


def lobe(d_mm: ArrayLike, energy: ArrayLike) -> Curve:
    """The curve of a lobe of a width d for each channel.

    d_mm : (3,) above 0 [mm]
    energy : (3,) A [-]
    """
    d = np.maximum(np.asarray(d_mm, np.float64), _THINNEST_MM)
    return Curve.of(BurleyProfile(np.ones(3), 1.0 / d).within, energy)


def fit_d(curve: Curve) -> Floats:
    """Widths d (3,) of the lobes whose cumulative profiles differ least from the curve at their worst [mm].

    A wider lobe has less light within each radius, so its largest surplus falls with d and its largest lack
    grows: where they are equal, the difference is least. Least squares would weigh radii as they are spaced.
    """
    return np.array([_fit(curve.radii_mm, curve.share[:, i]) for i in range(3)])


def _fit(radius_mm: Floats, share: Floats) -> float:
    middle = np.log(np.interp(0.5, share, radius_mm) / _HALF)
    low, high = middle - np.log(_FACTOR), middle + np.log(_FACTOR)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        one = BurleyProfile(np.ones(1), np.exp(np.array([-middle])))
        surplus = one.within(radius_mm)[:, 0] - share
        low, high = (middle, high) if surplus.max() > -surplus.min() else (low, middle)
    return float(np.exp(0.5 * (low + high)))


_ROUNDS = 40
_REACH = np.log(30.0)  # of sizes about that with the same median


def resized(unit: Curve, size_mm: ArrayLike) -> Curve:
    """A curve whose lengths are in a unit, with a unit (3,) for each channel."""
    size = np.maximum(np.asarray(size_mm, np.float64), 1e-9)

    def within(radius_mm: Floats) -> Floats:
        return np.stack([unit.within(radius_mm / size[i])[:, i] for i in range(3)], axis=-1)

    return Curve.of(within, unit.energy)


def nearest_size(curve: Curve, unit: Curve) -> Floats:
    """Units (3,) with the least largest difference from a curve: surplus and lack are equal there [mm]."""
    middle = np.log(curve.radius_of(0.5) / unit.radius_of(0.5))
    low, high = middle - _REACH, middle + _REACH
    for _ in range(_ROUNDS):
        middle = 0.5 * (low + high)
        over = resized(unit, np.exp(middle)).share - curve.share
        wider = over.max(axis=0) > -over.min(axis=0)
        low, high = np.where(wider, middle, low), np.where(wider, high, middle)
    return np.asarray(np.exp(middle))


@dataclass(frozen=True)
class Homogeneous:
    """A half-space of one medium, scattering made isotropic.

    albedo : (3,) of one scattering, reduced [-]
    mfp_mm : (3,) reduced mean free path [mm]
    curve : what it shows
    """

    albedo: Floats
    mfp_mm: Floats
    curve: Curve

    @property
    def sigma_s_prime(self) -> Floats:
        """(3,) reduced scattering [1/mm]."""
        return self.albedo / self.mfp_mm

    @property
    def sigma_a(self) -> Floats:
        """(3,) absorption [1/mm]."""
        return (1.0 - self.albedo) / self.mfp_mm


def homogeneous(curve: Curve, energy: Floats | None = None, kind: Kind = "skin") -> Homogeneous:
    """The medium with a curve's energy whose cumulative profile is nearest to the curve.

    energy : (3,) total that it has instead, a colour's [-]
    kind : surface and light of the half-space
    """
    albedo = albedo_of(kind, curve.energy if energy is None else energy)
    wide = fit_d(half_space(kind, albedo, np.ones(3)))
    mfp = fit_d(curve) / wide  # both are as wide as the same lobe
    mfp = _nearest(curve, kind, albedo, mfp)
    return Homogeneous(albedo, mfp, half_space(kind, albedo, mfp))


def _nearest(curve: Curve, kind: Kind, albedo: Floats, guess: Floats) -> Floats:
    """Mean free paths of the least largest difference: surplus and lack are equal there, as in `fit_d`."""
    unit = half_space(kind, albedo, np.ones(3))
    low, high = np.log(guess) - 2.0, np.log(guess) + 2.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        scaled = curve.radii_mm[:, None] / np.exp(middle)
        over = np.stack([unit.within(scaled[:, i])[:, i] for i in range(3)], axis=-1) - curve.share
        wider = over.max(axis=0) > -over.min(axis=0)
        low, high = np.where(wider, middle, low), np.where(wider, high, middle)
    return np.asarray(np.exp(0.5 * (low + high)))


_LEAST, _MOST, _NODES = 1e-2, 60.0, 400  # radii that a fit is judged at, by the true median
_KNOWN = np.geomspace(1e-4, 1e4, 2000)
_SPAN, _EXACT = (
    2.0,
    1e-4,
)  # logarithms of lengths: around the one of the same median, and as far as they matter


def fit_length(curve: Curve, channel: int, within: Callable[[Floats], Floats]) -> float:
    """The length by which a cumulative profile is nearest to one channel's: least squares over log r [mm].

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


_FARTHEST, _DISTANCES = 12.0, 97  # of an edge's distances, in median radii


@dataclass(frozen=True)
class Deviation:
    """What a target shows against what is true, in red, green and blue.

    cdf : (3,) largest difference of the share of light that leaves within a radius [-]
    edge : (3,) largest difference of what leaves beside a straight edge of light: a shadow's [-]
    energy : (3,) light that leaves in all over the true one's, less 1 [-]
    """

    cdf: Floats
    edge: Floats
    energy: Floats

    def as_json(self) -> dict[str, list[float]]:
        """Plain lists of three by name."""
        return {name: [round(float(x), 6) for x in getattr(self, name)] for name in ("cdf", "edge", "energy")}


def deviation(true: Curve, shown: Curve) -> Deviation:
    """How far what is shown is from what is true."""
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
