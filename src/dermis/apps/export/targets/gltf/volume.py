"""Conversion between scattering media and glTF's volumes, whose surfaces refract light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.export.fitting import fit_homogeneous_medium
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.half_space import half_space, tabulated_albedo
from dermis.optics.media import Floats

_MIN_COLOUR = 1e-300
_MAX_COLOUR = 1.0 - 1e-12


class Volume(NamedTuple):
    """Parameters of KHR_materials_volume and KHR_materials_scatter that determine the diffusion profile.

    distance_m : attenuationDistance [m]
    colour : (3,) attenuationColor: transmittance of the medium over the attenuation distance [-]
    multiscatter : (3,) multiscatterColorFactor: diffuse reflectance of the medium without its surface [-]
    """

    distance_m: float
    colour: Floats
    multiscatter: Floats

    @property
    def mean_free_path_mm(self) -> Floats:
        """Return the mean free paths (3,) that follow from the attenuation [mm]."""
        return np.asarray(1e3 * self.distance_m / -np.log(np.clip(self.colour, _MIN_COLOUR, _MAX_COLOUR)))


def volume_from_mean_free_paths(mean_free_path_mm: ArrayLike, multiscatter: ArrayLike) -> Volume:
    """Return the volume with given mean free paths, the longest of which is the attenuation distance.

    mean_free_path_mm : (3,) mean free paths [mm]
    multiscatter : (3,) multiscatter colour [-]
    """
    path = np.asarray(mean_free_path_mm, np.float64)
    longest = float(path.max())
    return Volume(1e-3 * longest, np.exp(-longest / path), np.asarray(multiscatter, np.float64))


def single_scattering_albedo(multiscatter: ArrayLike, anisotropy: float = 0.0) -> Floats:
    """Return the single-scattering albedo for a multiscatter colour by van de Hulst's formula [-].

    anisotropy : mean cosine of the scattering angle [-]

    Source: [dEon2016] equation 53.7, as used by KHR_materials_scatter.
    """
    C = np.asarray(multiscatter, np.float64)
    s = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    return np.asarray((1.0 - s**2) / (1.0 - anisotropy * s**2))


def multiscatter_colour(albedo: ArrayLike) -> Floats:
    """Return the multiscatter colour for a single-scattering albedo with isotropic scattering [-].

    This is the inverse of `single_scattering_albedo`.
    """
    s = np.sqrt(np.clip(1.0 - np.asarray(albedo, np.float64), 0.0, 1.0))
    return np.asarray((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))


def multiscatter_for_reflectance(reflectance: ArrayLike) -> Floats:
    """Return the multiscatter colour of skin that reflects a given fraction of the incident light [-].

    reflectance : diffusely reflected light per incident light [-]
    """
    return multiscatter_colour(tabulated_albedo("skin", reflectance))


def volume_profile(volume: Volume) -> CumulativeProfile:
    """Return the cumulative profile of the light that a volume returns through its surface."""
    return half_space("skin", single_scattering_albedo(volume.multiscatter), volume.mean_free_path_mm)


def fit_volume(reference_profile: CumulativeProfile, energy: Floats | None = None) -> Volume:
    """Return the volume whose cumulative profile is closest to a reference profile.

    energy : (3,) light that leaves the volume per incident light [-]; by default the energy of the reference
        profile
    """
    medium = fit_homogeneous_medium(reference_profile, energy)
    return volume_from_mean_free_paths(medium.mfp_mm, multiscatter_colour(medium.albedo))
