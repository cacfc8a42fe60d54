"""Edge loss of spectrophotometers: reflected light that their apertures miss, by Monte Carlo."""

from __future__ import annotations

import numpy as np

from dermis.apps.truths.slab_mc import SlabResult, trace_medium
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.pigments.skin import spectral_medium

APERTURES_MM = {"8 mm of 11 mm": (4.0, 5.5), "3 mm of 6 mm": (1.5, 3.0)}
"""For common apertures, the radius of the measured disc and the radius of the lit disc [mm]."""
_RADIUS_COUNT = 400  # number of points of the measured disc, by their radii


def edge_loss(
    skin: SkinParameters, wavelength_nm: Floats, photon_count: int = 60_000, seed: int = 1
) -> dict[str, Floats]:
    """Return the fractions (n,) of the reflected light that spectrophotometers miss, by aperture [-].

    A spectrophotometer lights a disc of the skin. Some of the light that enters near the edge leaves the skin
    outside the disc, and no light from the dark surroundings replaces it.

    skin : parameters of the skin
    wavelength_nm : (n,) wavelengths
    photon_count : number of photons per wavelength

    Source: [Wang1995].
    """
    runs = trace_medium(spectral_medium("dj2006", skin, wavelength_nm), photon_count, seed)
    return {
        name: np.array([_missed_fraction(run, *radii) for run in runs])
        for name, radii in APERTURES_MM.items()
    }


def _missed_fraction(slab_result: SlabResult, measured_radius_mm: float, lit_radius_mm: float) -> float:
    """Return the fraction of the reflected light that an aperture misses [-].

    slab_result : reflectance of the skin by distance from the point of entry
    measured_radius_mm, lit_radius_mm : radii of the measured and of the lit disc
    """
    inner, outer = slab_result.edges_mm[:-1], slab_result.edges_mm[1:]
    energy = slab_result.reflectance * np.pi * (outer**2 - inner**2)
    middle = np.sqrt(0.5 * (outer**2 + inner**2))
    returned = float(energy @ lit_fraction(middle, measured_radius_mm, lit_radius_mm))
    return 1.0 - returned / slab_result.total_reflectance


def lit_fraction(distance_mm: Floats, measured_radius_mm: float, lit_radius_mm: float) -> Floats:
    """Return the probability (n,) that a point at a given distance from a random measured point is lit [-].

    Measured points are uniformly distributed over the measured disc, and the direction is random.

    distance_mm : (n,) distances between the two points
    measured_radius_mm : radius of the measured disc
    lit_radius_mm : radius of the lit disc, which has the same centre
    """
    r = np.maximum(distance_mm, 1e-12)
    point = np.sqrt((np.arange(_RADIUS_COUNT) + 0.5) / _RADIUS_COUNT)[:, None] * measured_radius_mm
    cosine = (lit_radius_mm**2 - point**2 - r**2) / (2.0 * point * r)
    return np.asarray((1.0 - np.arccos(np.clip(cosine, -1.0, 1.0)) / np.pi).mean(axis=0))
