"""Diffuse colours of many skins at once, from a table over melanin and blood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.optics.bands import Bands
from dermis.optics.diffusion.boundary import boundary_mismatch, normal_reflectance
from dermis.optics.diffusion.layered_diffusion import two_layer_table
from dermis.optics.media import SKIN_ETA, Floats
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.pigments.skin import dj2006_layers
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

_COLOUR_TABLE_NODES = 65


@dataclass(frozen=True)
class ColourTable:
    """Table of the diffuse reflectance of skins, over melanin (first axis) and blood (second axis).

    colours : (n, n, 3) diffuse reflectance relative to the incident light, linear Rec. 709, at fractions of
        melanin and blood whose square roots are evenly spaced from 0 to 1 [-]
    """

    colours: Floats

    def lookup(self, melanin: Floats, blood: Floats) -> Floats:
        """Return the diffuse reflectance (k, 3) of k skins, interpolated in the table, linear Rec. 709 [-].

        melanin : (k,) fraction of the epidermal volume that is melanosomes, 0 to 1 [-]
        blood : (k,) fraction of the dermal volume that is blood, 0 to 1 [-]

        Interpolation is bilinear in the square roots of the fractions; reflectance is nearly linear in them.
        The error is at most 0.0015 for fractions of at least 0.001, and at most 0.006 for smaller fractions
        of blood.
        """
        n = len(self.colours)
        (i, u), (j, v) = (_cell_and_offset(fraction, n) for fraction in (melanin, blood))
        flat = self.colours.reshape(n * n, 3)
        index = i * n + j
        low = flat[index] + v * (flat[index + 1] - flat[index])
        high = flat[index + n] + v * (flat[index + n + 1] - flat[index + n])
        return np.asarray(low + u * (high - low))


def _cell_and_offset(pigment_fraction: Floats, node_count: int) -> tuple[NDArray[np.int64], Floats]:
    """Return the table interval (k,) that contains each fraction, and the position (k, 1) in this interval.

    An interval is given by the index of its lower end. Positions are from 0 to 1, and linear in the square
    root of the fraction.

    pigment_fraction : (k,) fractions of melanin or blood [-]
    node_count : number of fractions along the axis of the table
    """
    position = np.sqrt(np.clip(pigment_fraction, 0.0, 1.0)) * (node_count - 1)
    cell = np.minimum(position.astype(np.int64), node_count - 2)
    return cell, (position - cell)[:, None]


def colour_table(
    parameters: SkinParameters, node_count: int = _COLOUR_TABLE_NODES, bands: Bands | None = None
) -> ColourTable:
    """Return the diffuse reflectance of skins for a grid of melanin and blood, by layered diffusion.

    parameters : parameters of the skins; melanin and blood are ignored
    node_count : number n of fractions along each axis of the table
    bands : wavelengths in the place of red, green and blue
    """
    if bands is not None:
        return ColourTable(spectral_table(parameters, node_count, np.array(bands.wavelengths_nm)))
    spectra = spectral_table(parameters, node_count)
    colours = spectra.reshape(-1, len(WAVELENGTHS_NM)) @ rgb_weights(WAVELENGTHS_NM).T
    return ColourTable(np.maximum(colours, 0.0).reshape(node_count, node_count, 3))


def spectral_table(
    parameters: SkinParameters,
    node_count: int = _COLOUR_TABLE_NODES,
    wavelength_nm: Floats = WAVELENGTHS_NM,
) -> Floats:
    """Return the diffuse reflectance spectra (n, n, c) of skins for a grid of melanin and blood [-].

    The parameters and the grid are those of `colour_table`.

    wavelength_nm : (c,) wavelengths from 380 to 1000 [nm]
    """
    fractions = np.linspace(0.0, 1.0, node_count) ** 2
    epidermis, dermis = dj2006_layers(parameters, fractions, wavelength_nm)
    mismatch = boundary_mismatch(SKIN_ETA, "exact")
    spectra = two_layer_table(epidermis, parameters.epidermis_mm, dermis, mismatch)
    return (1.0 - normal_reflectance(SKIN_ETA)) * spectra
