"""What glTF's volume means for light: a walk under a refracting surface, by the draft's own inversion."""

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
    """The numbers of KHR_materials_volume and KHR_materials_scatter that say how light spreads.

    distance_m, colour : attenuationDistance [m] and attenuationColor (3,)
    multiscatter : multiscatterColorFactor (3,) [-]
    """

    distance_m: float
    colour: Floats
    multiscatter: Floats

    @property
    def mean_free_path_mm(self) -> Floats:
        """(3,) between two events [mm]."""
        return np.asarray(1e3 * self.distance_m / -np.log(np.clip(self.colour, _MIN_COLOUR, _MAX_COLOUR)))


def volume_from_paths(mean_free_path_mm: ArrayLike, multiscatter: ArrayLike) -> Volume:
    """The numbers for mean free paths (3,): the longest is the distance, so that no colour underflows."""
    path = np.asarray(mean_free_path_mm, np.float64)
    longest = float(path.max())
    return Volume(1e-3 * longest, np.exp(-longest / path), np.asarray(multiscatter, np.float64))


def single_scattering(multiscatter: ArrayLike, anisotropy: float = 0.0) -> Floats:
    """Albedo of single scattering of a colour, as KHR_materials_scatter has it: van de Hulst's [-].

    Source: [dEon2016] equation 53.7.
    """
    C = np.asarray(multiscatter, np.float64)
    s = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    return np.asarray((1.0 - s**2) / (1.0 - anisotropy * s**2))


def multiscatter_colour(albedo: ArrayLike) -> Floats:
    """The colour of an albedo of isotropic single scattering: the same the other way [-]."""
    s = np.sqrt(np.clip(1.0 - np.asarray(albedo, np.float64), 0.0, 1.0))
    return np.asarray((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))


def multiscatter_for_reflectance(energy: ArrayLike) -> Floats:
    """The colour with which a share (...,) of the light that enters comes back through the surface [-]."""
    return multiscatter_colour(tabulated_albedo("skin", energy))


def volume_curve(volume: Volume) -> CumulativeProfile:
    """The curve of light that walks through such a volume."""
    return half_space("skin", single_scattering(volume.multiscatter), volume.mean_free_path_mm)


def fit_volume(curve: CumulativeProfile, energy: Floats | None = None) -> Volume:
    """The volume whose walk gives back a curve's energy, and is nearest to it cumulatively.

    energy : (3,) that it gives back instead, a colour map's [-]
    """
    medium = fit_homogeneous_medium(curve, energy)
    return volume_from_paths(medium.mfp_mm, multiscatter_colour(medium.albedo))
