"""Diffuse reflectance spectra of many skins with different pigments, computed at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion.boundary import boundary_mismatch, normal_reflectance
from dermis.optics.diffusion.layered_diffusion import solve_two_layers
from dermis.optics.media import SKIN_ETA, Floats, Layer
from dermis.optics.pigments.spectra import (
    DERMIS_SCATTERING_RATIO,
    WAVELENGTHS_NM,
    baseline_absorption,
    blood_absorption,
    donner_jensen_scattering,
    eumelanin_absorption,
    pheomelanin_absorption,
)


def skin_reflectance(
    melanin: ArrayLike,
    blood_fraction: ArrayLike,
    *,
    oxygen: ArrayLike,
    eumelanin_fraction: ArrayLike,
    epidermis_mm: ArrayLike,
    baseline: ArrayLike,
    scattering: ArrayLike = 1.0,
) -> Floats:
    """Return the diffuse reflectance spectra (n, 31) of n skins by layered diffusion [-].

    Each skin is an epidermis on a semi-infinite dermis, the structure "dj2006". The reflectance is relative
    to the incident light and excludes surface reflection. All arguments are numbers or arrays (n,).

    melanin : fraction of the epidermal volume that is melanosomes [-]
    blood_fraction : fraction of the dermal volume that is blood [-]
    oxygen : fraction of oxygenated haemoglobin [-]
    eumelanin_fraction : fraction of the melanosomes that contain eumelanin [-]
    epidermis_mm : thickness of the epidermis [mm]
    baseline : absorption of bloodless tissue relative to [Jacques1998] [-]
    scattering : scattering of both layers relative to [DonnerJensen2006] [-]
    """
    m, b, ox, eu = map(_as_column, (melanin, blood_fraction, oxygen, eumelanin_fraction))
    bloodless = _as_column(baseline) * baseline_absorption(WAVELENGTHS_NM)
    pigment = eu * eumelanin_absorption(WAVELENGTHS_NM) + (1.0 - eu) * pheomelanin_absorption(WAVELENGTHS_NM)
    vessels = ox * blood_absorption(WAVELENGTHS_NM, 1.0) + (1.0 - ox) * blood_absorption(WAVELENGTHS_NM, 0.0)
    sigma_s_prime = _as_column(scattering) * donner_jensen_scattering(WAVELENGTHS_NM)
    epidermis = m * pigment + (1.0 - m) * bloodless
    return two_layer_reflectance(
        epidermis, b * vessels + (1.0 - b) * bloodless, sigma_s_prime, _as_column(epidermis_mm)
    )


def two_layer_reflectance(
    epidermis_absorption: Floats,
    dermis_absorption: Floats,
    sigma_s_prime: Floats,
    epidermis_mm: ArrayLike,
    scattering_ratio: float = DERMIS_SCATTERING_RATIO,
) -> Floats:
    """Return the diffuse reflectance (n, c) of an epidermis on a semi-infinite dermis [-].

    The reflectance is relative to the incident light.

    epidermis_absorption, dermis_absorption : (n, c) absorption coefficients of the layers [1/mm]
    sigma_s_prime : (n, c) or (c,) reduced scattering coefficient of the epidermis [1/mm]
    epidermis_mm : (n, 1) thicknesses of the epidermis, or one number [mm]
    scattering_ratio : scattering coefficient of the dermis relative to the epidermis [-]
    """
    upper, lower = (
        Layer(epidermis_absorption, sigma_s_prime),
        Layer(dermis_absorption, scattering_ratio * sigma_s_prime),
    )
    A = boundary_mismatch(SKIN_ETA, "exact")
    return (1.0 - normal_reflectance(SKIN_ETA)) * solve_two_layers(upper, epidermis_mm, lower, A)


def _as_column(number_or_array: ArrayLike) -> Floats:
    """Return a number or an array as an array with one more axis at the end: (n,) becomes (n, 1)."""
    return np.asarray(number_or_array, np.float64)[..., None]
