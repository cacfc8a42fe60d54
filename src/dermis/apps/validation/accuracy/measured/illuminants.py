"""CIE illuminants, under which the colours of measured and modelled skin are compared."""

from __future__ import annotations

from functools import cache

from dermis.images.colour import linear_of_xyz
from dermis.optics.lamps import xyz_weights
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

ILLUMINANTS = ("D65", "A", "FL11", "LED-B3")
"""Illuminants of the comparison, from `dermis.optics.lamps.LAMPS`."""


@cache
def colour_weights(illuminant: str) -> Floats:
    """Return weights (3, 31) that convert reflectance spectra to linear Rec. 709 colours.

    Each colour has the L*a*b* coordinates under D65 that its spectrum has under the illuminant.

    illuminant : one of `ILLUMINANTS`

    Source: [CIE2004] for the formulae of L*a*b*.
    """
    if illuminant == "D65":
        return rgb_weights()
    xyz = xyz_weights(illuminant, WAVELENGTHS_NM)
    return linear_of_xyz((xyz / xyz.sum(axis=1, keepdims=True)).T).T
