"""Conversion between reflectance spectra of skin and four variables: melanin, blood, oxygen, thickness."""

from __future__ import annotations

from typing import Final

import numpy as np

from dermis.apps.inverse.unmixing.spectral_inversion import least_squares, skin_model_spectra
from dermis.base.arrays import Doubles
from dermis.images.colour import lab
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

_VARIABLE_LOWER_BOUNDS: Final = np.array([-13.3, -13.3, 0.0, np.log2(0.02)])
_VARIABLE_UPPER_BOUNDS: Final = np.array([-0.3, -1.5, 1.0, np.log2(0.2)])
_START_MELANIN, _START_BLOOD = 0.04, 0.01
_PRIOR_MEAN: Final = np.array([0.7, np.log2(DEFAULT_SKIN.epidermis_mm)])
_PRIOR_SD: Final = np.array([0.3, 0.2])
"""Standard deviations of the priors of oxygenation and of log2 of the thickness of the epidermis.

If the prior of the thickness were wide, skin that the model cannot match would get the thinnest possible
epidermis. Melanin cannot darken such a thin layer enough for every skin tone.
"""
_CIELAB_SD = 0.3
"""Standard deviation of colours in the fit [CIELAB]; small, so that colours take precedence over spectra."""
_REFLECTANCE_SD = 0.01
_INDEPENDENT_WAVELENGTH_COUNT = (
    9.0  # number of wavelengths whose errors are independent; neighbours err together
)


def model_spectra(skin_variables: Doubles) -> Doubles:
    """Return the diffuse reflectance (n, 31) of skins, by the package's spectral model.

    skin_variables : (n, 4) log2 of the melanin fraction, log2 of the blood fraction, oxygenation, and log2 of
        the thickness of the epidermis in mm; values are clipped to the range that `invert_spectra` returns
    """
    melanin, blood, oxygen, mm = np.clip(skin_variables, _VARIABLE_LOWER_BOUNDS, _VARIABLE_UPPER_BOUNDS).T
    values = {"melanin": np.exp2(melanin), "blood": np.exp2(blood), "oxygen": oxygen}
    return skin_model_spectra()(values | {"epidermis_mm": np.exp2(mm)})


def model_lab(skin_variables: Doubles) -> Doubles:
    """Return the CIELAB colours (n, 3) of skins.

    skin_variables : (n, 4) variables as in `model_spectra`
    """
    return lab(model_spectra(skin_variables) @ rgb_weights(WAVELENGTHS_NM).T)


def invert_spectra(reflectance: Doubles) -> Doubles:
    """Return the skin variables (n, 4), as in `model_spectra`, with which the model fits n spectra best.

    The fit minimises differences in colour first, and then differences between the spectra.

    reflectance : (n, 31) spectra at `WAVELENGTHS_NM`, without surface reflection [-]
    """
    target = lab(reflectance @ rgb_weights(WAVELENGTHS_NM).T)
    spectrum_sd = _REFLECTANCE_SD * np.sqrt(len(WAVELENGTHS_NM) / _INDEPENDENT_WAVELENGTH_COUNT)

    def residual(skin_variables: Doubles) -> Doubles:
        spectra = model_spectra(skin_variables)
        colours = lab(spectra @ rgb_weights(WAVELENGTHS_NM).T) - target
        prior = (skin_variables[:, 2:] - _PRIOR_MEAN) / _PRIOR_SD
        return np.hstack([(spectra - reflectance) / spectrum_sd, colours / _CIELAB_SD, prior])

    start = np.array([np.log2(_START_MELANIN), np.log2(_START_BLOOD), *_PRIOR_MEAN])
    return least_squares(
        residual, np.tile(start, (len(reflectance), 1)), _VARIABLE_LOWER_BOUNDS, _VARIABLE_UPPER_BOUNDS
    )
