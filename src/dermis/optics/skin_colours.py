"""Colours of many skins at once: a table over melanin and blood, and how to read it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.diffusion.hankel import STILL
from dermis.optics.diffusion.models import transform
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.pigments.skin import mixed_layers
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

_NODES = 65
_TOGETHER = 5  # rows of a table, small enough for a processor's cache
_COEFFICIENTS = ("sigma_a", "sigma_s_prime")


@dataclass(frozen=True)
class ColourTable:
    """Colours of skins that differ in melanin and blood alone.

    colours : (n, n, 3) diffuse reflectance per incident light, linear Rec. 709, at the squares of evenly
        spaced numbers from 0 to 1, melanin first [-]
    """

    colours: Floats

    def read(self, melanin: Floats, blood: Floats) -> Floats:
        """Colours (k, 3) of skins with these shares (k,) of melanin and blood, 0 to 1 [-].

        Bilinear in the square roots, along which reflectance falls almost straight: 0.004 off at worst, where
        there is next to no blood, and 0.0015 where there is 0.001 of both.
        """
        n = len(self.colours)
        (i, u), (j, v) = (_split(share, n) for share in (melanin, blood))
        flat = self.colours.reshape(n * n, 3)
        at = i * n + j
        near = flat[at] + v * (flat[at + 1] - flat[at])
        far = flat[at + n] + v * (flat[at + n + 1] - flat[at + n])
        return np.asarray(near + u * (far - near))


def _split(share: Floats, nodes: int) -> tuple[NDArray[np.int64], Floats]:
    """The node before each share, and how far (k, 1) it is to the next."""
    place = np.sqrt(np.clip(share, 0.0, 1.0)) * (nodes - 1)
    before = np.minimum(place.astype(np.int64), nodes - 2)
    return before, (place - before)[:, None]


def colour_table(parameters: SkinParameters, nodes: int = _NODES) -> ColourTable:
    """The colours of all skins like this one, by layered diffusion; its own melanin and blood are ignored.

    nodes : along each side of the table
    """
    epidermis, dermis = mixed_layers(parameters, np.linspace(0.0, 1.0, nodes) ** 2)
    bloods = np.arange(nodes)
    spectra = []
    for melanins in np.array_split(np.arange(nodes), -(-nodes // _TOGETHER)):
        rows, columns = np.repeat(melanins, nodes), np.tile(bloods, len(melanins))
        medium = Medium("skins", (_picked(epidermis, rows), _picked(dermis, columns)), SKIN_ETA)
        total = transform(medium, "layered", "layer", STILL)[0]
        spectra.append(total.reshape(-1, len(WAVELENGTHS_NM)))
    entering = 1.0 - normal_reflectance(SKIN_ETA)
    colours = entering * np.concatenate(spectra) @ rgb_weights(WAVELENGTHS_NM).T
    return ColourTable(np.maximum(colours, 0.0).reshape(nodes, nodes, 3))


def _picked(layer: Layer, rows: NDArray[np.int64]) -> Layer:
    """Rows of a stacked layer, their channels in one line."""
    return replace(layer, **{name: getattr(layer, name)[rows].ravel() for name in _COEFFICIENTS})
