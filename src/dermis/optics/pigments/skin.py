"""Layered structures of skin: from pigments to the absorption and scattering spectra of each layer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final, get_args

import numpy as np

from dermis.base.errors import format_value, refuse
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium
from dermis.optics.pigments.parameters import SkinParameters, Structure
from dermis.optics.pigments.spectra import (
    DERMIS_SCATTERING_RATIO,
    WAVELENGTHS_NM,
    ScatteringLaw,
    baseline_absorption,
    blood_absorption,
    donner_jensen_scattering,
    infrared_absorption,
    melanosome_absorption,
    tissue_wavelengths,
)

MELANIN_SHEET_ABSORPTION_RATIO: Final = 0.175
"""Absorption by the melanin sheet, relative to all melanin of the epidermis, after [Donner2008] [-]."""

_MELANIN_SHEET_MM = 0.001
_STRATUM_CORNEUM_MM, _PAPILLARY_DERMIS_MM = 0.01, 0.2
_RETICULAR_BLOOD_RATIO = 0.0091 / 0.012
_UNIFORM_INDEX_NOTE = f"all layers have the index {SKIN_ETA:g}, without reflection between them"
_BASELINE_NOTE = "what was measured on rats; 0.5 fits the spectra of measured people"
_THIN_LAYER_NOTE = "the multipole is inaccurate for so thin a layer: use layered diffusion"
_LayerBuilder = Callable[[SkinParameters, Floats, Floats], tuple[Layer, ...]]


def spectral_medium(
    structure: Structure,
    parameters: SkinParameters,
    wavelength_nm: Floats = WAVELENGTHS_NM,
    scattering: ScatteringLaw = donner_jensen_scattering,
) -> Medium:
    """Return the medium of a skin with given pigments, with one channel for each wavelength.

    structure : "dj2006" is an epidermis on a semi-infinite dermis; "donner2008" has blood in both epidermis
        and dermis, and a thin melanin sheet between them; "biospec" has a stratum corneum, an epidermis and
        two dermal layers
    parameters : pigment fractions and epidermal thickness
    wavelength_nm : (n,) wavelengths from 380 to 1000 [nm]
    scattering : function from wavelengths to the reduced scattering coefficient of the epidermis

    All layers have the same index of refraction. The thin layers of "donner2008" and "biospec" require the
    model "layered", because the multipole is inaccurate for thin layers.

    Raises DermisError for an unknown structure and for wavelengths out of range.

    Source: [DonnerJensen2006], [Donner2008], [KrishnaswamyBaranoski2004]; [Lu2025] for the default absorption
    of tissue without blood and melanin.
    """
    if structure not in _STRUCTURES:
        known = ", ".join(get_args(Structure))
        refuse("structure", known, f"got {format_value(structure)}", "Choose one of them")
    wavelengths = tissue_wavelengths(wavelength_nm)
    layers, note, sources = _STRUCTURES[structure]
    stack = layers(parameters, wavelengths, scattering(wavelengths))
    notes: tuple[str, ...] = (note, _UNIFORM_INDEX_NOTE)
    if parameters.baseline != 1.0:
        notes += (f"tissue without blood and melanin absorbs {parameters.baseline:g} of {_BASELINE_NOTE}",)
        sources = (*sources, "Lu2025")
    return Medium(structure, stack, SKIN_ETA, notes, sources)


def _build_dj2006(
    parameters: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats
) -> tuple[Layer, ...]:
    """Return an epidermis and a dermis after [DonnerJensen2006].

    sigma_s_prime : (n,) reduced scattering coefficient of the epidermis at the n wavelengths [1/mm]
    """
    return _epidermis_layer(parameters, wavelength_nm, sigma_s_prime), _dermis_layer(
        parameters, wavelength_nm, sigma_s_prime
    )


def _build_donner2008(
    parameters: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats
) -> tuple[Layer, ...]:
    """Return an epidermis, a melanin sheet and a dermis after equations 11 and 12 of [Donner2008].

    sigma_s_prime : (n,) reduced scattering coefficient of the epidermis at the n wavelengths [1/mm]
    """
    melanin = parameters.melanin * melanosome_absorption(wavelength_nm, parameters.eumelanin)
    sheet_sigma_a = MELANIN_SHEET_ABSORPTION_RATIO * melanin * parameters.epidermis_mm / _MELANIN_SHEET_MM
    return (
        _epidermis_layer(parameters, wavelength_nm, sigma_s_prime, parameters.epidermal_blood),
        # Diffusion needs scattering everywhere; in so thin a sheet it has no visible effect.
        Layer(sheet_sigma_a, sigma_s_prime, _MELANIN_SHEET_MM, "melanin sheet"),
        _dermis_layer(parameters, wavelength_nm, sigma_s_prime),
    )


def _build_biospec(
    parameters: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats
) -> tuple[Layer, ...]:
    """Return four skin layers after [KrishnaswamyBaranoski2004].

    The constants are from code that one of the paper's authors published.

    sigma_s_prime : (n,) reduced scattering coefficient of the epidermis at the n wavelengths [1/mm]
    """
    reticular = replace(parameters, blood=_RETICULAR_BLOOD_RATIO * parameters.blood)
    return (
        Layer(
            _bloodless_absorption(parameters, wavelength_nm),
            sigma_s_prime,
            _STRATUM_CORNEUM_MM,
            "stratum corneum",
        ),
        _epidermis_layer(parameters, wavelength_nm, sigma_s_prime),
        replace(
            _dermis_layer(parameters, wavelength_nm, sigma_s_prime, "papillary dermis"),
            thickness_mm=_PAPILLARY_DERMIS_MM,
        ),
        _dermis_layer(reticular, wavelength_nm, sigma_s_prime, "reticular dermis"),
    )


def _epidermis_layer(
    parameters: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats, blood_fraction: float = 0.0
) -> Layer:
    """Return the epidermis, a mixture of melanosomes, a given fraction of blood, and bloodless tissue.

    sigma_s_prime : (n,) reduced scattering coefficient of the epidermis at the n wavelengths [1/mm]
    """
    sigma_a = _epidermal_absorption(parameters, parameters.melanin, wavelength_nm, blood_fraction)
    return Layer(sigma_a, sigma_s_prime, parameters.epidermis_mm, "epidermis")


def _epidermal_absorption(
    parameters: SkinParameters, melanin: float | Floats, wavelength_nm: Floats, blood_fraction: float = 0.0
) -> Floats:
    tissue = (1.0 - melanin - blood_fraction) * _bloodless_absorption(parameters, wavelength_nm)
    pigment = melanin * melanosome_absorption(wavelength_nm, parameters.eumelanin)
    return np.asarray(pigment + blood_fraction * blood_absorption(wavelength_nm, parameters.oxygen) + tissue)


def _dermis_layer(
    parameters: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats, name: str = "dermis"
) -> Layer:
    """Return a semi-infinite dermis, a mixture of blood and bloodless tissue.

    sigma_s_prime : (n,) reduced scattering coefficient of the epidermis at the n wavelengths; it is
        multiplied by `DERMIS_SCATTERING_RATIO` [1/mm]
    """
    sigma_a = _dermal_absorption(parameters, parameters.blood, wavelength_nm)
    return Layer(sigma_a, DERMIS_SCATTERING_RATIO * sigma_s_prime, name=name)


def _dermal_absorption(
    parameters: SkinParameters, blood_fraction: float | Floats, wavelength_nm: Floats
) -> Floats:
    vessels = blood_fraction * blood_absorption(wavelength_nm, parameters.oxygen)
    return np.asarray(vessels + (1.0 - blood_fraction) * _bloodless_absorption(parameters, wavelength_nm))


def _bloodless_absorption(parameters: SkinParameters, wavelength_nm: Floats) -> Floats:
    """Return the absorption of tissue without blood and melanin [1/mm]."""
    baseline = parameters.baseline * baseline_absorption(wavelength_nm)
    return np.asarray(baseline + infrared_absorption(wavelength_nm))


def dj2006_layers(
    parameters: SkinParameters, pigment_fractions: Floats, wavelength_nm: Floats = WAVELENGTHS_NM
) -> tuple[Layer, Layer]:
    """Return epidermis and dermis of the structure "dj2006" for each of n pigment fractions.

    The coefficients of both layers have the shape (n, c) for c wavelengths.

    parameters : parameters of the skins; its fields `melanin` and `blood` are ignored
    pigment_fractions : (n,) fractions, used both as melanin fractions of the epidermis and as blood fractions
        of the dermis [-]
    wavelength_nm : (c,) wavelengths from 380 to 1000 [nm]
    """
    column, scattering = pigment_fractions[:, None], donner_jensen_scattering(wavelength_nm)
    epidermal = _epidermal_absorption(parameters, column, wavelength_nm)
    dermal = _dermal_absorption(parameters, column, wavelength_nm)
    ratios = 1.0, DERMIS_SCATTERING_RATIO
    upper, lower = (np.broadcast_to(ratio * scattering, epidermal.shape) for ratio in ratios)
    epidermis = Layer(epidermal, upper, parameters.epidermis_mm, "epidermis")
    return epidermis, Layer(dermal, lower, name="dermis")


_STRUCTURES: dict[str, tuple[_LayerBuilder, str, tuple[str, ...]]] = {
    "dj2006": (
        _build_dj2006,
        "formulae as quoted by public code; the thickness of the epidermis is not known to be the paper's",
        ("DonnerJensen2006", "Jacques1998", "Prahl1999"),
    ),
    "donner2008": (
        _build_donner2008,
        f"the sheet adds {MELANIN_SHEET_ABSORPTION_RATIO:.1%} of what the melanin above it absorbs, as "
        f"public code reads the paper; carotene is left out; {_THIN_LAYER_NOTE}",
        ("Donner2008", "DonnerJensen2006", "Jacques1998", "Prahl1999"),
    ),
    "biospec": (
        _build_biospec,
        "BioSpec traces rays and has no reduced scattering: the law of dj2006 is used instead; its epidermis "
        "is 0.1 mm thick, its reticular dermis 1.8 mm on a mirror, but semi-infinite here; carotene and "
        f"bilirubin are left out; {_THIN_LAYER_NOTE}",
        ("KrishnaswamyBaranoski2004", "DonnerJensen2006", "Jacques1998", "Prahl1999"),
    ),
}
