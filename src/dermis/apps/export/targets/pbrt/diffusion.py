"""The curve of pbrt's material "subsurface": photon beam diffusion, in a table of albedos and radii."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.optics.diffusion.boundary import fresnel, internal_moment

Floats = NDArray[np.float64]

_ALBEDOS, _RADII, _DEPTHS = 100, 64, 100
_FIRST, _GROWTH = 2.5e-3, 1.2  # of the radii [mean free paths]
_DENSE = 8.0


class Table(NamedTuple):
    """What pbrt computes for an index of refraction.

    albedo : (n,) [-]
    radius : (m,) [mean free paths]
    reflectance : (n,) of each albedo [-]
    within : (n, m) share of what enters that leaves within the radii [-]
    """

    albedo: Floats
    radius: Floats
    reflectance: Floats
    within: Floats

    def reflectance_of(self, albedo: float) -> float:
        """All that leaves a medium of an albedo of single scattering, per light that enters [-]."""
        return float(np.interp(albedo, self.albedo, self.reflectance))

    def curve(self, radius: ArrayLike, reflectance: float) -> Floats:
        """Share of what enters that leaves within radii, for the albedo that pbrt finds for a reflectance."""
        at = np.interp(reflectance, self.reflectance, np.arange(_ALBEDOS))
        low = int(min(at, _ALBEDOS - 2))
        share = self.within[low] + (at - low) * (self.within[low + 1] - self.within[low])
        return np.asarray(np.interp(np.asarray(radius, np.float64), self.radius, share))


@cache
def diffusion_table(eta: float) -> Table:
    """pbrt's table for isotropic scattering in a medium with an index of refraction.

    Source: [Habel2013] in the form of [Pharr2023]; the moments of the reflectance are exact here.
    """
    radius = np.concatenate([[0.0], _FIRST * _GROWTH ** np.arange(_RADII - 1)])
    albedo = np.expm1(-_DENSE * np.arange(_ALBEDOS) / (_ALBEDOS - 1)) / np.expm1(-_DENSE)
    several = np.stack([_scattered_often(radius, one, eta) for one in albedo])
    profile = 2.0 * np.pi * radius * (several + albedo[:, None] * _scattered_once(radius, eta))
    within = _integrated(radius, profile)
    return Table(albedo, radius, within[:, -1], within)


def _scattered_often(radius: Floats, albedo: float, eta: float) -> Floats:
    """(m,) radiant exitance of light scattered more than once, at an extinction of 1."""
    D = (2.0 - albedo) / 3.0
    decay = np.sqrt((1.0 - albedo) / D)
    first, second = internal_moment(1, eta), internal_moment(2, eta)
    mirror = -2.0 * D * (1.0 + 3.0 * second) / (1.0 - 2.0 * first)
    real = _depths()[:, None]
    image = 2.0 * mirror - real
    near, far = np.hypot(radius, real), np.hypot(radius, image)
    fluence = (np.exp(-decay * near) / near - np.exp(-decay * far) / far) / D
    flux = sum(
        sign * z * (1.0 + decay * d) * np.exp(-decay * d) / d**3
        for sign, z, d in ((1.0, real, near), (-1.0, image, far))
    )
    exitance = 0.25 * (1.0 - 2.0 * first) * fluence + 0.5 * (1.0 - 3.0 * second) * flux
    kappa = -np.expm1(-2.0 * (near + real))
    return np.asarray(albedo**2 * (kappa * exitance).mean(axis=0) / (4.0 * np.pi))


def _scattered_once(radius: Floats, eta: float) -> Floats:
    """(m,) radiant exitance of light scattered once, over the albedo, at an extinction of 1."""
    least = radius * np.sqrt(eta**2 - 1.0)  # under which all is reflected back inside
    depth = least + _depths()[:, None]
    way = np.hypot(radius, depth)
    cosine = depth / way
    leaves = 1.0 - fresnel(cosine, 1.0 / eta)
    return np.asarray((np.exp(-way - least) / way**2 * leaves * cosine).mean(axis=0) / (4.0 * np.pi))


def _depths() -> Floats:
    return np.asarray(-np.log1p(-(np.arange(_DEPTHS) + 0.5) / _DEPTHS))


def _integrated(x: Floats, values: Floats) -> Floats:
    """(n, m) integrals from the first of x, by Catmull's and Rom's splines through values (n, m)."""
    slope = np.empty_like(values)
    slope[:, 1:-1] = (values[:, 2:] - values[:, :-2]) / (x[2:] - x[:-2])
    slope[:, 0] = (values[:, 1] - values[:, 0]) / (x[1] - x[0])
    slope[:, -1] = (values[:, -1] - values[:, -2]) / (x[-1] - x[-2])
    width = np.diff(x)
    part = width * (0.5 * (values[:, 1:] + values[:, :-1]) + width * (slope[:, :-1] - slope[:, 1:]) / 12.0)
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(part, axis=1)], axis=1)
