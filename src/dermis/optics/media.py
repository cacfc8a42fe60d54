"""Turbid media, as layers with absorption and scattering coefficients; published media, and TOML files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse
from dermis.base.quantities import checked_array, checked_number
from dermis.base.tables import read_rows
from dermis.optics.reduced_scattering import check_reduced

Floats = NDArray[np.float64]

SKIN_ETA = 1.4
"""Index of refraction of skin relative to air, as in most of the cited works [-]."""
_TABLE_SOURCES = {"jensen2001": ("Jensen2001",), "donner-jensen-2005": ("DonnerJensen2005",)}
_DONNER_JENSEN_UNIT_NOTE = (
    "the printed coefficients are read in 1/cm. Read in 1/mm, as the 2007 deck does, red light would "
    "travel 0.02083 mm between events in the epidermis and nearly all of it would leave within 0.1 mm. The "
    "published sum of six Gaussians follows from neither reading: it is the preset gpu-gems-3"
)
_ETA_RANGE = 1.0, 2.5  # from an index-matched surface to more than diamond
_MIN_SCATTERING_PER_MM = 1e-6  # that of clear water [1/mm]
_MAX_COEFFICIENT_PER_MM = 1e6  # ten times the absorption of a metal [1/mm]
_MIN_THICKNESS_MM, _MAX_THICKNESS_MM = 1e-9, 1e4  # from less than an atom to more than a human body
_COEFFICIENT_KEYS = ("absorption_per_mm", "scattering_per_mm")


@dataclass(frozen=True)
class Layer:
    """Homogeneous layer of a medium, with coefficients for c channels or wavelengths.

    sigma_a : (c,) absorption coefficients [1/mm]
    sigma_s_prime : (c,) reduced scattering coefficients [1/mm]
    thickness_mm : thickness; infinity for a half-space [mm]
    name : name of the layer, shown in tables and messages

    Source: [Jensen2001] section 2 for the symbols.
    """

    sigma_a: Floats
    sigma_s_prime: Floats
    thickness_mm: float = float("inf")
    name: str = "layer"

    @property
    def sigma_t_prime(self) -> Floats:
        """Return the reduced extinction coefficient (c,), absorption plus reduced scattering [1/mm]."""
        return self.sigma_a + self.sigma_s_prime

    @property
    def alpha_prime(self) -> Floats:
        """Return the reduced albedo (c,), reduced scattering divided by reduced extinction [-]."""
        return self.sigma_s_prime / self.sigma_t_prime

    @property
    def mean_free_path_mm(self) -> Floats:
        """Return the reduced mean free path (c,), the inverse of the reduced extinction [mm]."""
        return 1.0 / self.sigma_t_prime

    @property
    def D(self) -> Floats:
        """Return the diffusion coefficient (c,), 1 / (3 sigma_t') [mm]."""
        return 1.0 / (3.0 * self.sigma_t_prime)

    @property
    def sigma_tr(self) -> Floats:
        """Return the effective transport coefficient (c,), sqrt(3 sigma_a sigma_t') [1/mm]."""
        return np.sqrt(3.0 * self.sigma_a * self.sigma_t_prime)


@dataclass(frozen=True)
class Medium:
    """Stack of layers below a smooth surface, topmost first; below the last layer there is air.

    name : name of the preset or file
    layers : one or more layers; only the last may be semi-infinite
    eta : index of refraction of all layers relative to air; 1 for an index-matched surface [-]
    notes : remarks on the origin of the coefficients, shown to the user
    sources : keys of the bibliography
    """

    name: str
    layers: tuple[Layer, ...]
    eta: float = SKIN_ETA
    notes: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raise DermisError for an invalid index of refraction or invalid layers."""
        if not self.layers:
            refuse(self.name, "at least one layer", "got none", "Add one")
        checked_number(f"{self.name}: index of refraction", self.eta, *_ETA_RANGE)
        for position, layer in enumerate(self.layers, 1):
            _check_layer(f"{self.name}, layer {position} ({layer.name})", layer, position == len(self.layers))
        if len({len(layer.sigma_a) for layer in self.layers}) > 1:
            refuse(self.name, "the same number of channels in each layer", "they differ", "Correct the lists")

    @property
    def channels(self) -> int:
        """Return the number of channels or wavelengths, which is the same for all layers."""
        return len(self.layers[0].sigma_a)

    @property
    def is_semi_infinite(self) -> bool:
        """Return whether the last layer is semi-infinite."""
        return bool(np.isinf(self.layers[-1].thickness_mm))

    def with_eta(self, eta: float) -> Medium:
        """Return the medium with another index of refraction."""
        return replace(self, eta=eta)

    def channel(self, channel_index: int) -> Medium:
        """Return the medium with one of its channels or wavelengths only."""
        channel = slice(channel_index, channel_index + 1)
        layers = tuple(
            replace(layer, sigma_a=layer.sigma_a[channel], sigma_s_prime=layer.sigma_s_prime[channel])
            for layer in self.layers
        )
        return replace(self, layers=layers)


def _check_layer(error_subject: str, layer: Layer, is_last: bool) -> None:
    a, s = layer.sigma_a, layer.sigma_s_prime
    if a.ndim != 1 or a.shape != s.shape or len(a) == 0:
        actual = f"got shapes {a.shape} and {s.shape}"
        refuse(
            error_subject,
            "one absorption and scattering coefficient per channel",
            actual,
            "Correct the lists",
        )
    if not (
        (a >= 0)
        & (a <= _MAX_COEFFICIENT_PER_MM)
        & (s >= _MIN_SCATTERING_PER_MM)
        & (s <= _MAX_COEFFICIENT_PER_MM)
    ).all():
        actual = f"got absorption {a.tolist()} and scattering {s.tolist()}"
        scattering_range = f"{_MIN_SCATTERING_PER_MM:g} to {_MAX_COEFFICIENT_PER_MM:g} /mm"
        expected = f"absorption from 0 and scattering from {scattering_range}"
        refuse(error_subject, expected, actual, "Correct them")
    semi_infinite = np.isinf(layer.thickness_mm) and layer.thickness_mm > 0 and is_last
    if not semi_infinite and not _MIN_THICKNESS_MM <= layer.thickness_mm <= _MAX_THICKNESS_MM:
        limits = f"{_MIN_THICKNESS_MM:g} to {_MAX_THICKNESS_MM:g} mm"
        expected = f"a thickness from {limits}, infinite in the last layer only"
        refuse(error_subject, expected, f"got {layer.thickness_mm} mm", "Correct it")


@cache
def published_media() -> Mapping[str, Medium]:
    """Return the published media, a dictionary from a name such as "skin1" or "dj3" to the medium.

    All of them have the index of refraction of skin.
    """
    named: dict[str, Medium] = {}
    for table, sources in _TABLE_SOURCES.items():
        for name, layers in _read_media(table).items():
            notes = (_DONNER_JENSEN_UNIT_NOTE,) if name == "dj3" else ()
            named[name] = Medium(name, tuple(layers), SKIN_ETA, notes, sources)
    return named


def medium_from_toml(path: Path, document: Mapping[str, Any]) -> Medium:
    """Return the medium that a parsed TOML file describes.

    path : path of the file, for errors, and for the name of the medium if the file does not state a name
    document : content of the file: optionally `name` and `eta`, and `[[layers]]`, topmost first. Each layer
        has `absorption_per_mm`, `scattering_per_mm` (lists of 3 numbers) and, except for the last layer,
        `thickness_mm`

    Raises DermisError for missing or unknown entries, and for values out of range.
    """
    tables = document.get("layers")
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        refuse(path, "[[layers]] with absorption_per_mm and scattering_per_mm", "it has none", "Add them")
    layers = tuple(_layer_from_table(f"{path}, layer {k}", table) for k, table in enumerate(tables, 1))
    check_reduced(str(path), document)
    unknown = sorted(set(document) - {"name", "eta", "layers"})
    if unknown:
        refuse(path, "name, eta and [[layers]]", f"got {', '.join(unknown)}", "Take them out")
    eta = checked_number(f"{path}: eta", document.get("eta", SKIN_ETA), *_ETA_RANGE)
    return Medium(str(document.get("name", path.stem)), layers, eta)


def _layer_from_table(error_subject: str, layer_entries: Mapping[str, Any]) -> Layer:
    check_reduced(error_subject, layer_entries)
    unknown = sorted(set(layer_entries) - {"name", "thickness_mm", *_COEFFICIENT_KEYS})
    if unknown:
        known = ", ".join(("name", "thickness_mm", *_COEFFICIENT_KEYS))
        refuse(error_subject, known, f"got {', '.join(unknown)}", "Take it out or correct its name")
    absorption, scattering = (
        _rgb_coefficients(error_subject, layer_entries, key) for key in _COEFFICIENT_KEYS
    )
    thickness = layer_entries.get("thickness_mm", np.inf)
    if thickness != np.inf:
        thickness = checked_number(
            f"{error_subject}: thickness_mm", thickness, _MIN_THICKNESS_MM, _MAX_THICKNESS_MM
        )
    return Layer(absorption, scattering, thickness, str(layer_entries.get("name", "layer")))


def _rgb_coefficients(error_subject: str, layer_entries: Mapping[str, Any], coefficient_key: str) -> Floats:
    unit = "1/mm in red, green and blue"
    return checked_array(
        f"{error_subject}: {coefficient_key}",
        layer_entries.get(coefficient_key),
        (3,),
        0.0,
        _MAX_COEFFICIENT_PER_MM,
        unit,
    )


def _read_media(table_name: str) -> dict[str, list[Layer]]:
    found: dict[str, list[Layer]] = {}
    for row in read_rows("dermis.optics", f"data/media/{table_name}"):
        medium, layer, thickness, *coefficients = row.values()
        sigma = np.array(coefficients, dtype=np.float64)
        found.setdefault(medium, []).append(Layer(sigma[:3], sigma[3:], float(thickness), layer))
    return found


def albedo_from_colour(diffuse_reflectance: ArrayLike, g: float = 0.0) -> Floats:
    """Return the single-scattering albedo of a half-space with a given diffuse reflectance [-].

    diffuse_reflectance : diffuse reflectances from 0 to 1, an array of any shape [-]
    g : mean cosine of the scattering angle [-]

    Source: [dEon2016] eq. 53.7, the inverse of van de Hulst's formula.
    """
    C = np.clip(np.asarray(diffuse_reflectance, np.float64), 0.0, 1.0)
    s = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    s = np.clip(s, 0.0, 1.0)
    return np.asarray((1.0 - s**2) / (1.0 - g * s**2))
