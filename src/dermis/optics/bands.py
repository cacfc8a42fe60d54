"""Bands: three wavelengths that take the place of red, green and blue, and spectra of RGB colours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, interpolate_spectrum, tissue_wavelengths


def rgb_spectra(wavelength_nm: ArrayLike) -> Floats:
    """Return smooth reflectances (..., 3) of red, green and blue of Rec. 709, which sum to 1 [-].

    The spectrum of a colour is their sum weighted by its channels; under D65 it has this colour. Below 400
    and above 700 nm the spectra are constant.

    wavelength_nm : (...) wavelengths from 380 to 1000 [nm]

    Source: [MallettYuksel2019] for the method.
    """
    inside = np.clip(tissue_wavelengths(wavelength_nm), WAVELENGTHS_NM[0], WAVELENGTHS_NM[-1])
    columns = (interpolate_spectrum("rgb-basis", name, inside) for name in ("red", "green", "blue"))
    return np.stack(list(columns), axis=-1)


@dataclass(frozen=True)
class Bands:
    """Three wavelengths in the place of red, green and blue.

    wavelengths_nm : wavelengths from 380 to 1000 [nm]
    """

    wavelengths_nm: tuple[float, float, float]

    @cached_property
    def of_rgb(self) -> Floats:
        """Return the matrix (3, 3) from RGB colours to reflectances at the wavelengths [-]."""
        return rgb_spectra(self.wavelengths_nm)

    def reflectance(self, linear_colours: ArrayLike) -> Floats:
        """Return the reflectances (..., 3) of linear Rec. 709 colours (..., 3) at the wavelengths [-]."""
        return np.asarray(np.asarray(linear_colours, np.float64) @ self.of_rgb.T)


def band_rows(bands: Bands | None) -> Floats:
    """Return the matrix from RGB colours to the channels of a picture as rows (3, 4) of a uniform record.

    bands : wavelengths of the channels; None for red, green and blue
    """
    return np.eye(3, 4) if bands is None else np.pad(bands.of_rgb, ((0, 0), (0, 1)))
