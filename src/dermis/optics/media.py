"""Turbid media: layers that absorb and scatter, in channels or in wavelengths, by name and from files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse
from dermis.base.quantities import number, numbers
from dermis.base.tables import read_rows

Floats = NDArray[np.float64]

SKIN_ETA = 1.4
"""Index of refraction of skin, as most of the works cited here take it [-]."""
_SOURCES = {"jensen2001": ("Jensen2001",), "donner-jensen-2005": ("DonnerJensen2005",)}
_DJ3_NOTE = (
    "the printed coefficients are read in 1/cm. Read in 1/mm, as the 2007 deck does, red light would "
    "travel 0.02083 mm between events in the epidermis and nearly all of it would leave within 0.1 mm. The "
    "published sum of six Gaussians follows from neither reading: it is the preset gpu-gems-3"
)
_ETA = 1.0, 2.5  # indices of refraction, from a matched surface to more than diamond
_CLEAREST, _DENSEST = 1e-6, 1e6  # from clear water to ten times a metal's absorption [1/mm]
_THINNEST_MM, _THICKEST_MM = 1e-9, 1e4  # from less than an atom to more than a body
_KEYS = ("absorption_per_mm", "scattering_per_mm")


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
    layers : at least one; only the last may be semi-infinite
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
        number(f"{self.name}: index of refraction", self.eta, *_ETA)
        for count, layer in enumerate(self.layers, 1):
            _check(f"{self.name}, layer {count} ({layer.name})", layer, count == len(self.layers))
        if len({len(layer.sigma_a) for layer in self.layers}) > 1:
            refuse(self.name, "as many channels in each layer", "they differ", "Correct the lists")

    @property
    def channels(self) -> int:
        """How many channels or wavelengths the layers have."""
        return len(self.layers[0].sigma_a)

    @property
    def semi_infinite(self) -> bool:
        """Whether the last layer goes on without end below."""
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
    if not ((a >= 0) & (a <= _DENSEST) & (s >= _CLEAREST) & (s <= _DENSEST)).all():
        came = f"absorption {a.tolist()} and scattering {s.tolist()} came"
        expected = f"absorption from 0 and scattering from {_CLEAREST:g} to {_DENSEST:g} /mm"
        refuse(place, expected, came, "Correct them")
    endless = np.isinf(layer.thickness_mm) and layer.thickness_mm > 0 and last
    if not endless and not _THINNEST_MM <= layer.thickness_mm <= _THICKEST_MM:
        expected = (
            f"a thickness from {_THINNEST_MM:g} to {_THICKEST_MM:g} mm, infinite in the last layer only"
        )
        refuse(place, expected, f"{layer.thickness_mm} mm came", "Correct it")


@cache
def media() -> Mapping[str, Medium]:
    """The named media, with skin's index of refraction."""
    found: dict[str, Medium] = {}
    for table, sources in _SOURCES.items():
        for name, layers in _read(table).items():
            notes = (_DJ3_NOTE,) if name == "dj3" else ()
            found[name] = Medium(name, tuple(layers), SKIN_ETA, notes, sources)
    return found


def medium_from_toml(path: Path, document: Mapping[str, Any]) -> Medium:
    """The medium that a parsed TOML file describes.

    document : `eta` and, topmost first, `[[layers]]` with `absorption_per_mm` and `scattering_per_mm` (lists
        of 3), and `thickness_mm` in all but the last

    Raises DermisError for any other content.
    """
    tables = document.get("layers")
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        refuse(path, "[[layers]] with absorption_per_mm and scattering_per_mm", "it has none", "Add them")
    layers = tuple(_layer(f"{path}, layer {count}", table) for count, table in enumerate(tables, 1))
    unknown = sorted(set(document) - {"name", "eta", "layers"})
    if unknown:
        refuse(path, "name, eta and [[layers]]", f"{', '.join(unknown)} came", "Take them out")
    eta = number(f"{path}: eta", document.get("eta", SKIN_ETA), *_ETA)
    return Medium(str(document.get("name", path.stem)), layers, eta)


def _layer(place: str, table: Mapping[str, Any]) -> Layer:
    unknown = sorted(set(table) - {"name", "thickness_mm", *_KEYS})
    if unknown:
        known = ", ".join(("name", "thickness_mm", *_KEYS))
        refuse(place, known, f"{', '.join(unknown)} came", "Take it out or correct its name")
    absorption, scattering = (_three(place, table, key) for key in _KEYS)
    thickness = table.get("thickness_mm", np.inf)
    if thickness != np.inf:
        thickness = number(f"{place}: thickness_mm", thickness, _THINNEST_MM, _THICKEST_MM)
    return Layer(absorption, scattering, thickness, str(table.get("name", "layer")))


def _three(place: str, table: Mapping[str, Any], key: str) -> Floats:
    return numbers(f"{place}: {key}", table.get(key), (3,), 0.0, _DENSEST, "1/mm in red, green and blue")


def _read(table: str) -> dict[str, list[Layer]]:
    found: dict[str, list[Layer]] = {}
    for row in read_rows("dermis.optics", f"data/media/{table}"):
        medium, layer, thickness, *coefficients = row.values()
        sigma = np.array(coefficients, dtype=np.float64)
        found.setdefault(medium, []).append(Layer(sigma[:3], sigma[3:], float(thickness), layer))
    return found


def albedo_of_colour(colour: ArrayLike, g: float = 0.0) -> Floats:
    """Albedo of single scattering with which a half-space returns a colour, of its shape [-].

    g : mean cosine of the deflection [-]

    Source: van de Hulst's formula inverted, [dEon2016] eq. 53.7.
    """
    C = np.clip(np.asarray(colour, np.float64), 0.0, 1.0)
    s = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    s = np.clip(s, 0.0, 1.0)
    return np.asarray((1.0 - s**2) / (1.0 - g * s**2))


def colour_of_albedo(albedo: ArrayLike, g: float = 0.0) -> Floats:
    """Share of diffuse light that a half-space returns, of the albedo's shape [-].

    g : mean cosine of the deflection [-]

    Source: van de Hulst's formula, [dEon2016].
    """
    alpha = np.asarray(albedo, np.float64)
    s = np.sqrt((1.0 - alpha) / (1.0 - alpha * g))
    return np.asarray((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))
