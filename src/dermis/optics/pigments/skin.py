"""Structures of the layers of a skin, each with an absorption and a scattering spectrum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final, get_args

import numpy as np

from dermis.base.errors import refuse, shown_value
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium
from dermis.optics.pigments.parameters import SkinParameters, Structure
from dermis.optics.pigments.spectra import (
    DERMIS_SHARE,
    WAVELENGTHS_NM,
    ScatteringLaw,
    baseline,
    blood,
    donner_jensen_2006,
    melanosome,
    visible,
)

LEAKED_MELANIN: Final = 0.175
"""Absorption of the sheet under the epidermis over that of the epidermis' melanin, after [Donner2008] [-]."""

_SHEET_MM = 0.001
_CORNEUM_MM, _PAPILLARY_MM = 0.01, 0.2
_RETICULAR_BLOOD = 0.0091 / 0.012
_ONE_INDEX = f"all layers have the index {SKIN_ETA:g}: light meets no surface between them"
_THIN = "the multipole misjudges so thin a layer: take layered diffusion"
_Build = Callable[[SkinParameters, Floats, Floats], tuple[Layer, ...]]


def spectral_medium(
    structure: Structure,
    parameters: SkinParameters,
    wavelength_nm: Floats = WAVELENGTHS_NM,
    scattering: ScatteringLaw = donner_jensen_2006,
) -> Medium:
    """The layers of a skin, with a channel for each wavelength.

    structure : "dj2006" is an epidermis on a semi-infinite dermis; "donner2008" has a thin sheet of melanin
        between them and blood in both; "biospec" has a stratum corneum, an epidermis and two layers of dermis
    parameters : what they are made of
    wavelength_nm : (n,) from 380 to 780 [nm]
    scattering : law of the epidermis

    All layers share one index of refraction. The thin layers of the last two structures need the model
    "layered": the multipole misjudges them.

    Raises DermisError for another structure or wavelength.

    Source: [DonnerJensen2006], [Donner2008], [KrishnaswamyBaranoski2004].
    """
    if structure not in _STRUCTURES:
        refuse(
            "structure", ", ".join(get_args(Structure)), f"{shown_value(structure)} came", "Take one of them"
        )
    wavelengths = visible(wavelength_nm)
    layers, note, sources = _STRUCTURES[structure]
    stack = layers(parameters, wavelengths, scattering(wavelengths))
    return Medium(structure, stack, SKIN_ETA, (note, _ONE_INDEX), sources)


def _dj2006(p: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats) -> tuple[Layer, ...]:
    """Source: [DonnerJensen2006]."""
    return _epidermis(p, wavelength_nm, sigma_s_prime), _dermis(p, wavelength_nm, sigma_s_prime)


def _donner2008(p: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats) -> tuple[Layer, ...]:
    """Source: [Donner2008] equations 11 and 12 for the two layers."""
    melanin = p.melanin * melanosome(wavelength_nm, p.eumelanin)
    sheet_sigma_a = LEAKED_MELANIN * melanin * p.epidermis_mm / _SHEET_MM
    return (
        _epidermis(p, wavelength_nm, sigma_s_prime, p.epidermal_blood),
        # Diffusion needs scattering everywhere; that of so thin a sheet does not show.
        Layer(sheet_sigma_a, sigma_s_prime, _SHEET_MM, "melanin sheet"),
        _dermis(p, wavelength_nm, sigma_s_prime),
    )


def _biospec(p: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats) -> tuple[Layer, ...]:
    """Source: [KrishnaswamyBaranoski2004], numbers as public code of its first author starts from."""
    deep = replace(p, blood=_RETICULAR_BLOOD * p.blood)
    return (
        Layer(baseline(wavelength_nm), sigma_s_prime, _CORNEUM_MM, "stratum corneum"),
        _epidermis(p, wavelength_nm, sigma_s_prime),
        replace(_dermis(p, wavelength_nm, sigma_s_prime, "papillary dermis"), thickness_mm=_PAPILLARY_MM),
        _dermis(deep, wavelength_nm, sigma_s_prime, "reticular dermis"),
    )


def _epidermis(
    p: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats, perfused: float = 0.0
) -> Layer:
    """Melanosomes, blood in a share of the volume, and tissue in the rest."""
    sigma_a = _epidermal_absorption(p, p.melanin, wavelength_nm, perfused)
    return Layer(sigma_a, sigma_s_prime, p.epidermis_mm, "epidermis")


def _epidermal_absorption(
    p: SkinParameters, melanin: float | Floats, wavelength_nm: Floats, perfused: float = 0.0
) -> Floats:
    rest = (1.0 - melanin - perfused) * baseline(wavelength_nm)
    brown = melanin * melanosome(wavelength_nm, p.eumelanin)
    return np.asarray(brown + perfused * blood(wavelength_nm, p.oxygen) + rest)


def _dermis(p: SkinParameters, wavelength_nm: Floats, sigma_s_prime: Floats, name: str = "dermis") -> Layer:
    """Blood, and tissue in the rest of the volume; semi-infinite."""
    sigma_a = _dermal_absorption(p, p.blood, wavelength_nm)
    return Layer(sigma_a, DERMIS_SHARE * sigma_s_prime, name=name)


def _dermal_absorption(p: SkinParameters, red: float | Floats, wavelength_nm: Floats) -> Floats:
    return np.asarray(red * blood(wavelength_nm, p.oxygen) + (1.0 - red) * baseline(wavelength_nm))


def mixed_layers(parameters: SkinParameters, shares: Floats) -> tuple[Layer, Layer]:
    """The two layers of "dj2006" with other shares (n,) of melanin and of blood; coefficients (n, 31)."""
    column, scattered = shares[:, None], donner_jensen_2006(WAVELENGTHS_NM)
    brown = _epidermal_absorption(parameters, column, WAVELENGTHS_NM)
    red = _dermal_absorption(parameters, column, WAVELENGTHS_NM)
    epidermis, dermis = (np.broadcast_to(k * scattered, brown.shape) for k in (1.0, DERMIS_SHARE))
    return Layer(brown, epidermis, parameters.epidermis_mm, "epidermis"), Layer(red, dermis, name="dermis")


_STRUCTURES: dict[str, tuple[_Build, str, tuple[str, ...]]] = {
    "dj2006": (
        _dj2006,
        "formulae as quoted by public code; the thickness of the epidermis is not known to be the paper's",
        ("DonnerJensen2006", "Jacques1998", "Prahl1999"),
    ),
    "donner2008": (
        _donner2008,
        f"the sheet adds {LEAKED_MELANIN:.1%} of what the melanin above it absorbs, as public code reads the "
        f"paper; carotene is left out; {_THIN}",
        ("Donner2008", "DonnerJensen2006", "Jacques1998", "Prahl1999"),
    ),
    "biospec": (
        _biospec,
        "BioSpec follows rays and has no reduced scattering: the law of dj2006 stands in; its epidermis is "
        "0.1 mm thick, its reticular dermis 1.8 mm on a mirror, which has no end here; carotene and "
        f"bilirubin are left out; {_THIN}",
        ("KrishnaswamyBaranoski2004", "DonnerJensen2006", "Jacques1998", "Prahl1999"),
    ),
}
