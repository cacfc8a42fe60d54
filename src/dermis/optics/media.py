"""Turbid media: layers that absorb and scatter, in channels or in wavelengths."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse

Floats = NDArray[np.float64]

SKIN_ETA = 1.4
"""Index of refraction of skin, as most of the works cited here take it [-]."""


@dataclass(frozen=True)
class Layer:
    """One homogeneous layer; the arrays hold a number for each of c channels or wavelengths.

    sigma_a : (c,) absorption [1/mm]
    sigma_s_prime : (c,) reduced scattering [1/mm]
    thickness_mm : infinity for a half-space [mm]
    name : what it is, for tables and messages

    Source: names after [Jensen2001] section 2.
    """

    sigma_a: Floats
    sigma_s_prime: Floats
    thickness_mm: float = float("inf")
    name: str = "layer"

    @property
    def sigma_t_prime(self) -> Floats:
        """Reduced extinction [1/mm]."""
        return self.sigma_a + self.sigma_s_prime

    @property
    def alpha_prime(self) -> Floats:
        """Reduced albedo [-]."""
        return self.sigma_s_prime / self.sigma_t_prime

    @property
    def mean_free_path_mm(self) -> Floats:
        """Reduced mean free path [mm]."""
        return 1.0 / self.sigma_t_prime

    @property
    def D(self) -> Floats:
        """Diffusion coefficient [mm]."""
        return 1.0 / (3.0 * self.sigma_t_prime)

    @property
    def sigma_tr(self) -> Floats:
        """Effective transport coefficient [1/mm]."""
        return np.sqrt(3.0 * self.sigma_a * self.sigma_t_prime)


@dataclass(frozen=True)
class Medium:
    """A stack of layers under a smooth surface, topmost first. Below the last one there is air.

    name : preset or file
    layers : at least one; only the last may be infinitely thick
    eta : index of refraction of all layers against the air; 1 is an index-matched surface [-]
    notes : what a reader must know of the numbers
    sources : citation keys
    """

    name: str
    layers: tuple[Layer, ...]
    eta: float = SKIN_ETA
    notes: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.layers:
            refuse(self.name, "at least one layer", "none came", "Add one")
        if not (np.isfinite(self.eta) and 1.0 <= self.eta <= 2.5):
            refuse(self.name, "an index of refraction from 1 to 2.5", f"{self.eta:g} came", "Correct it")
        for number, layer in enumerate(self.layers, 1):
            _check(f"{self.name}, layer {number} ({layer.name})", layer, number == len(self.layers))
        if len({len(layer.sigma_a) for layer in self.layers}) > 1:
            refuse(self.name, "as many channels in each layer", "they differ", "Correct the lists")

    @property
    def channels(self) -> int:
        """How many channels or wavelengths the layers have."""
        return len(self.layers[0].sigma_a)

    @property
    def semi_infinite(self) -> bool:
        """Whether the last layer has no bottom."""
        return bool(np.isinf(self.layers[-1].thickness_mm))

    def with_eta(self, eta: float) -> Medium:
        """The same layers under another surface."""
        return replace(self, eta=eta)

    def channel(self, index: int) -> Medium:
        """The stack as one channel or wavelength sees it."""
        keep = slice(index, index + 1)
        layers = tuple(
            replace(layer, sigma_a=layer.sigma_a[keep], sigma_s_prime=layer.sigma_s_prime[keep])
            for layer in self.layers
        )
        return replace(self, layers=layers)


def _check(place: str, layer: Layer, last: bool) -> None:
    a, s = layer.sigma_a, layer.sigma_s_prime
    if a.ndim != 1 or a.shape != s.shape or len(a) == 0:
        came = f"shapes {a.shape} and {s.shape} came"
        refuse(place, "as many absorption as scattering coefficients", came, "Correct the lists")
    if not (np.isfinite(a).all() and np.isfinite(s).all() and (a >= 0).all() and (s > 0).all()):
        came = f"absorption {a.tolist()} and scattering {s.tolist()} came"
        refuse(place, "absorption of 0 or more and scattering above 0 [1/mm]", came, "Correct them")
    if not layer.thickness_mm > 0 or (np.isinf(layer.thickness_mm) and not last):
        expected = "a thickness above 0 mm, infinite in the last layer only"
        refuse(place, expected, f"{layer.thickness_mm} mm came", "Correct it")
