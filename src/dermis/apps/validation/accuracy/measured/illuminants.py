"""CIE illuminants, under which the colours of measured and modelled skin are compared."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.base.tables import float_columns, read_rows
from dermis.images.colour import linear_of_xyz
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, interpolate_spectrum, rgb_weights

ILLUMINANTS = {"D65": "", "A": "a", "FL11": "fl11", "LED-B3": "led_b3"}
"""Column of each illuminant in the table of illuminants; D65 needs no column."""


@cache
def colour_weights(illuminant: str) -> Floats:
    """Return weights (3, 31) that convert reflectance spectra to linear Rec. 709 colours.

    Each colour has the L*a*b* coordinates under D65 that its spectrum has under the illuminant.

    illuminant : key of `ILLUMINANTS`

    Source: [CIE2004] for the observer and for the formulae of L*a*b*.
    """
    if illuminant == "D65":
        return rgb_weights()
    rows = read_rows("dermis.optics", "data/spectra/illuminants")
    fine, light = float_columns(rows, f"wavelength_nm {ILLUMINANTS[illuminant]}").T
    observer = np.array([interpolate_spectrum("cie-1931-d65", f"{axis}_bar", fine) for axis in "xyz"])
    hats = np.array([np.interp(fine, WAVELENGTHS_NM, unit) for unit in np.eye(len(WAVELENGTHS_NM))])
    xyz = (observer * light) @ hats.T
    return linear_of_xyz((xyz / xyz.sum(axis=1, keepdims=True)).T).T
