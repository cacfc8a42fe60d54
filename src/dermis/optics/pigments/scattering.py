"""How much skin scatters, by wavelength: laws for the epidermis; the dermis scatters half as much."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import visible

ScatteringLaw = Callable[[ArrayLike], Floats]
"""From wavelengths [nm] to the reduced scattering of the epidermis [1/mm]."""

DERMIS_SHARE: Final = 0.5
"""Scattering of the dermis over that of the epidermis, after [DonnerJensen2006] [-]."""


def donner_jensen_2006(wavelength_nm: ArrayLike) -> Floats:
    """Reduced scattering of the epidermis by the law of [DonnerJensen2006], read in 1/mm [1/mm].

    The unit could not be checked against the paper. Some read 1/cm, find a tenth of what skin scatters and
    replace the law. In 1/mm, half of it, which is the dermis', equals 73.7 lambda^-0.22 + 1.1e12 lambda^-4 in
    1/cm: the law that others give for skin after [Bashkatov2005], 3 per mm at 550 nm.

    wavelength_nm : (...) from 380 to 780 [nm]

    Source: [DonnerJensen2006], as quoted by public code.
    """
    wavelength = visible(wavelength_nm)
    return np.asarray(14.74 * wavelength**-0.22 + 2.2e11 * wavelength**-4.0)


def jacques_1998(wavelength_nm: ArrayLike) -> Floats:
    """Reduced scattering of skin, large fibres and small ones (Mie and Rayleigh) [1/mm].

    Jacques has the same for epidermis and dermis.

    wavelength_nm : (...) from 380 to 780 [nm]

    Source: [Jacques1998].
    """
    wavelength = visible(wavelength_nm)
    return np.asarray(2e4 * wavelength**-1.5 + 2e11 * wavelength**-4.0)
