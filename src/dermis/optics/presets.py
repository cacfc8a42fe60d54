"""Media by name and from files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from dermis.errors import refuse
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium

_SOURCES = {"jensen2001": ("Jensen2001",), "donner-jensen-2005": ("DonnerJensen2005",)}
_DJ3_NOTE = (
    "the printed coefficients are read in 1/cm. Read in 1/mm, as the 2007 deck does, red light would "
    "travel 0.02083 mm between events in the epidermis and nearly all of it would leave within 0.1 mm. The "
    "published sum of six Gaussians follows from neither reading: it is the preset gpu-gems-3"
)
_MOST_LETTERS = 1_000_000
_KEYS = ("absorption_per_mm", "scattering_per_mm")


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
    layers = tuple(_layer(f"{path}, layer {number}", table) for number, table in enumerate(tables, 1))
    unknown = sorted(set(document) - {"name", "eta", "layers"})
    if unknown:
        refuse(path, "name, eta and [[layers]]", f"{', '.join(unknown)} came", "Take them out")
    return Medium(str(document.get("name", path.stem)), layers, _number(path, document, "eta", SKIN_ETA))


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file's contents; DermisError when it cannot be read."""
    text = read_text(path, "a TOML file")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        refuse(path, "a TOML file", f"it cannot be read: {error}", "Check its contents")


def read_text(path: Path, form: str) -> str:
    """The text of a small file; DermisError, which names the form expected, when it cannot be read."""
    try:
        with path.open(encoding="utf-8") as file:
            text = file.read(_MOST_LETTERS + 1)  # some devices never end
    except (OSError, UnicodeDecodeError) as error:
        came = getattr(error, "strerror", None) or "it is not text"
        refuse(path, form, f"it cannot be read: {came}", "Check its name and its contents")
    if len(text) > _MOST_LETTERS:
        refuse(path, form, f"it has more than {_MOST_LETTERS:,} letters", "Check its name")
    return text


def _layer(place: str, table: Mapping[str, Any]) -> Layer:
    unknown = sorted(set(table) - {"name", "thickness_mm", *_KEYS})
    if unknown:
        known = ", ".join(("name", "thickness_mm", *_KEYS))
        refuse(place, known, f"{', '.join(unknown)} came", "Take it out or correct its name")
    absorption, scattering = (_three(place, table, key) for key in _KEYS)
    thickness = _number(place, table, "thickness_mm", float("inf"))
    return Layer(absorption, scattering, thickness, str(table.get("name", "layer")))


def _three(place: str, table: Mapping[str, Any], key: str) -> Floats:
    value = table.get(key)
    numbers = isinstance(value, list) and all(isinstance(one, int | float) for one in value)
    if not isinstance(value, list) or not numbers or len(value) != 3:
        refuse(place, f"{key} = [red, green, blue]", f"{value!r} came", "Write three numbers")
    return np.array(value, dtype=np.float64)


def _number(place: object, table: Mapping[str, Any], key: str, default: float) -> float:
    value = table.get(key, default)
    if not isinstance(value, int | float) or isinstance(value, bool):
        refuse(place, f"{key} as a number", f"{value!r} came", "Correct it")
    return float(value)


def _read(table: str) -> dict[str, list[Layer]]:
    text = resources.files("dermis.optics").joinpath(f"data/media/{table}.csv").read_text("utf-8")
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")][1:]
    found: dict[str, list[Layer]] = {}
    for medium, layer, thickness, *coefficients in rows:
        sigma = np.array(coefficients, dtype=np.float64)
        found.setdefault(medium, []).append(Layer(sigma[:3], sigma[3:], float(thickness), layer))
    return found
