"""The homogeneous half-space that is most like a skin, for targets that walk through media."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.apps.export.lobe import fit_d
from dermis.optics.curve import Curve
from dermis.optics.half_space import Kind, albedo_of, half_space
from dermis.optics.media import Floats


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
