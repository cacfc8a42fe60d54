"""CIE illuminants, under which the colours of measured and modelled skin are compared."""

from __future__ import annotations

from functools import cache

from dermis.optics import lamps
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM

ILLUMINANTS = ("D65", "A", "FL11", "LED-B3")
"""Illuminants of the comparison, from `dermis.optics.lamps.LAMPS`."""


@cache
def colour_weights(illuminant: str) -> Floats:
    """Return weights (3, 31) that convert reflectance spectra to linear Rec. 709 colours.

    Each colour has the L*a*b* coordinates under D65 that its spectrum has under the illuminant.

    illuminant : one of `ILLUMINANTS`
    """
    return lamps.colour_weights(illuminant, WAVELENGTHS_NM)
