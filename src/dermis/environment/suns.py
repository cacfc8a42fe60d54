"""Sun-like peaks of a panorama, taken out of it as lights: they cast shadows, the rest does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.environment.panorama import directions, mean_radiance, solid_angles
from dermis.images.colour import luminance

Floats = NDArray[np.float64]
MOST_SUNS = 4
_PEAK = 32.0  # times the mean radiance: what is brighter may belong to a sun
_NEAR_DEGREES = 8.0
_LEAST_SHARE = 0.05  # of the irradiance that the mean radiance gives


@dataclass(frozen=True)
class Sun:
    """A peak as light from one direction.

    direction : (3,) unit vector towards it
    irradiance : (3,) on a surface that faces it, linear Rec. 709
    radius : half of the angle that it spans [rad]
    """

    direction: Floats
    irradiance: Floats
    radius: float


def split_suns(radiance: Floats) -> tuple[Floats, list[Sun]]:
    """The panorama without its peaks, and the peaks, strongest first; together they hold all of its light.

    radiance : (h, w, 3)

    Each peak is the light above 32 times the mean within 8 degrees of the middle of what is bright. At most
    four are taken, and none that gives less than a twentieth of what the mean radiance gives. A lighter
    cousin of the median cut of light probes [Debevec2005].
    """
    mean = float(luminance(mean_radiance(radiance)))
    brightness = np.asarray(luminance(radiance), np.float64)
    above = brightness > _PEAK * mean
    towards = directions(*radiance.shape[:2])[above]
    weight = np.broadcast_to(solid_angles(*radiance.shape[:2]), above.shape)[above]
    keep = _PEAK * mean / brightness[above]
    light = radiance[above] * ((1.0 - keep) * weight)[:, None]
    left, suns = np.ones(len(keep)), list[Sun]()
    for inside in sorted(_clusters(brightness[above], towards, weight), key=lambda c: -_strength(light[c])):
        if len(suns) == MOST_SUNS or _strength(light[inside]) < _LEAST_SHARE * np.pi * mean:
            break
        suns.append(_sun(light[inside], towards[inside], weight[inside]))
        left[inside] = keep[inside]
    rest = radiance.copy()
    rest[above] *= left[:, None]
    return rest, suns


def _strength(light: Floats) -> float:
    return float(luminance(light.sum(axis=0)))


def _sun(light: Floats, towards: Floats, weight: Floats) -> Sun:
    """One light for the texels of a peak (n, 3), as wide as an even disc with the same mean square."""
    grey = np.asarray(luminance(light), np.float64)
    middle = grey @ towards
    solid_angle = grey.sum() ** 2 / (grey**2 / weight).sum()
    return Sun(middle / np.linalg.norm(middle), light.sum(axis=0), float(np.sqrt(solid_angle / np.pi)))


def _clusters(brightness: Floats, towards: Floats, weight: Floats) -> list[NDArray[np.bool_]]:
    """Bright texels (n,) sorted into peaks: those around the middle of those around the brightest left."""
    near = np.cos(np.radians(_NEAR_DEGREES))
    left = np.ones(len(brightness), bool)
    clusters = []
    while left.any():
        peak = np.where(left, brightness, 0.0).argmax()
        around = left & (towards @ towards[peak] > near)
        middle = weight[around] @ towards[around]
        inside = left & (towards @ middle > near * np.linalg.norm(middle))
        inside[peak] = True
        left &= ~inside
        clusters.append(inside)
    return clusters
