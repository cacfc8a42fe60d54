"""Sun-like peaks of a panorama, taken out of it as lights: they cast shadows, the rest does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.assets.environment.panorama import directions, mean_radiance, solid_angles
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
    """The panorama without its peaks, and the peaks, brightest first; together they hold all of its light.

    radiance : (h, w, 3)

    Each peak is the light above 32 times the mean within 8 degrees of the middle of what is bright; one that
    gives less than a twentieth of what the mean radiance gives stays in the picture. A lighter cousin of the
    median cut of light probes [Debevec2005].
    """
    rest = radiance.copy()
    suns: list[Sun] = []
    limit = _PEAK * float(luminance(mean_radiance(radiance)))
    towards = directions(*radiance.shape[:2])
    weight = np.broadcast_to(solid_angles(*radiance.shape[:2]), radiance.shape[:2])
    bright = np.asarray(luminance(radiance), np.float64)
    while len(suns) < MOST_SUNS and bright.max() > limit:
        inside = _cluster(bright > limit, towards, towards[np.unravel_index(bright.argmax(), bright.shape)])
        keep = limit / bright[inside]
        light = rest[inside] * ((1.0 - keep) * weight[inside])[:, None]
        irradiance = light.sum(axis=0)
        if luminance(irradiance) < _LEAST_SHARE * np.pi * limit / _PEAK:
            break
        middle = luminance(light) @ towards[inside]
        radius = float(np.sqrt(weight[inside].sum() / np.pi))
        suns.append(Sun(middle / np.linalg.norm(middle), irradiance, radius))
        rest[inside] *= keep[:, None]
        bright[inside] = limit
    return rest, suns


def _cluster(bright: NDArray[np.bool_], towards: Floats, peak: Floats) -> NDArray[np.bool_]:
    """Bright texels around the middle of those around a peak; the peak itself is among them."""
    near = np.cos(np.radians(_NEAR_DEGREES))
    middle = towards[bright & (towards @ peak > near)].mean(axis=0)
    inside: NDArray[np.bool_] = bright & (towards @ middle > near * np.linalg.norm(middle))
    return inside | (bright & (towards @ peak > 1.0 - 1e-9))
