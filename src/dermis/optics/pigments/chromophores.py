"""What absorbs light in skin (melanin, haemoglobin, water, bare tissue) and how much skin scatters it.

Wavelengths are arrays of any shape, from 380 to 780 [nm]; results have their shape.

Beta-carotene and bilirubin are left out: no tabulation under a fitting licence was found. They would do
little: in the amounts that public code of [KrishnaswamyBaranoski2004] starts from, the carotene above the
dermis has an optical depth of 0.0014 at its peak.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import tabulated, visible

_NM_PER_MM = 1e6
_MM_PER_CM = 10.0
_HAEMOGLOBIN_MOLAR = 150.0 / 64500.0  # in whole blood: 150 g/l of 64500 g/mol [mol/l]
ScatteringLaw = Callable[[ArrayLike], Floats]
"""From wavelengths [nm] to the reduced scattering of the epidermis [1/mm]."""
DERMIS_SHARE: Final = 0.5
"""Scattering of the dermis over that of the epidermis, after [DonnerJensen2006] [-]."""


def eumelanin(wavelength_nm: ArrayLike) -> Floats:
    """Absorption inside a melanosome that holds the brown to black melanin [1/mm].

    Source: [Jacques1998], as in [DonnerJensen2006].
    """
    return np.asarray(6.6e10 * visible(wavelength_nm) ** -3.33)


def pheomelanin(wavelength_nm: ArrayLike) -> Floats:
    """Absorption inside a melanosome that holds the yellow to red melanin [1/mm].

    Source: [DonnerJensen2006], as quoted by public code.
    """
    return np.asarray(2.9e14 * visible(wavelength_nm) ** -4.75)


def melanosome(wavelength_nm: ArrayLike, eumelanin_share: float) -> Floats:
    """Absorption inside melanosomes of which a share holds eumelanin, the rest pheomelanin [1/mm].

    eumelanin_share : 0 to 1 [-]

    Source: [DonnerJensen2006].
    """
    brown, red = eumelanin(wavelength_nm), pheomelanin(wavelength_nm)
    return eumelanin_share * brown + (1.0 - eumelanin_share) * red


def baseline(wavelength_nm: ArrayLike) -> Floats:
    """Absorption of skin without melanin and blood, measured on bloodless rat skin [1/mm].

    Source: [Jacques1998] section 1.1. Some code has -lambda - 154 for -(lambda - 154), which leaves little
    more than the constant.
    """
    return np.asarray(0.0244 + 8.53 * np.exp(-(visible(wavelength_nm) - 154.0) / 66.2))


def oxyhaemoglobin(wavelength_nm: ArrayLike) -> Floats:
    """Molar extinction of haemoglobin with oxygen, to base 10 [1/(cm M)].

    Source: [Prahl1999].
    """
    return tabulated("haemoglobin", "oxyhaemoglobin", wavelength_nm)


def deoxyhaemoglobin(wavelength_nm: ArrayLike) -> Floats:
    """Molar extinction of haemoglobin without oxygen, to base 10 [1/(cm M)].

    Source: [Prahl1999].
    """
    return tabulated("haemoglobin", "deoxyhaemoglobin", wavelength_nm)


def blood(wavelength_nm: ArrayLike, oxygen: float) -> Floats:
    """Absorption of whole blood [1/mm].

    oxygen : share of the haemoglobin that carries oxygen, 0 to 1 [-]

    Source: [Prahl1999].
    """
    extinction = oxygen * oxyhaemoglobin(wavelength_nm) + (1.0 - oxygen) * deoxyhaemoglobin(wavelength_nm)
    return np.asarray(np.log(10.0) * _HAEMOGLOBIN_MOLAR * extinction / _MM_PER_CM)


def water(wavelength_nm: ArrayLike) -> Floats:
    """Absorption of water: 4 pi k / lambda [1/mm].

    Up to 700 nm it is under 3 % of `baseline`, which was measured on moist tissue: no structure adds it.

    Source: [HaleQuerry1973].
    """
    k = tabulated("water", "k", wavelength_nm)
    return np.asarray(4.0 * np.pi * k * _NM_PER_MM / visible(wavelength_nm))


def donner_jensen_2006(wavelength_nm: ArrayLike) -> Floats:
    """Reduced scattering of the epidermis by the law of [DonnerJensen2006], read in 1/mm [1/mm].

    The unit could not be checked against the paper. Some read 1/cm, find a tenth of what skin scatters and
    replace the law. In 1/mm, half of it, which is the dermis', equals 73.7 lambda^-0.22 + 1.1e12 lambda^-4 in
    1/cm: the law that others give for skin after [Bashkatov2005], 3 per mm at 550 nm.

    Source: [DonnerJensen2006], as quoted by public code.
    """
    wavelength = visible(wavelength_nm)
    return np.asarray(14.74 * wavelength**-0.22 + 2.2e11 * wavelength**-4.0)


def jacques_1998(wavelength_nm: ArrayLike) -> Floats:
    """Reduced scattering of skin, large fibres and small ones (Mie and Rayleigh) [1/mm].

    Jacques has the same for epidermis and dermis.

    Source: [Jacques1998].
    """
    wavelength = visible(wavelength_nm)
    return np.asarray(2e4 * wavelength**-1.5 + 2e11 * wavelength**-4.0)
