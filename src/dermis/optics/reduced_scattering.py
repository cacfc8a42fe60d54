"""Refusal of scattering coefficients that are not reduced, with the reduced values."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import NoReturn

from dermis.base.errors import format_value, refuse
from dermis.base.reading import open_regular_file

MCML_SUFFIXES = (".mci", ".mco")
_ANISOTROPY_KEYS = ("g", "anisotropy")
_HEAD_BYTES = 1 << 16  # of an MCML file, in which its layers are
_MAX_LAYERS = 6  # in a message
_MAX_THICKNESS_MM = 1e4  # of a layer; thicker ones of MCML are semi-infinite


def check_reduced(culprit: str, table: Mapping[str, object]) -> None:
    """Refuse a layer with an anisotropy, whose scattering may not be reduced.

    table : layer with "scattering_per_mm"
    """
    key = next((key for key in _ANISOTROPY_KEYS if key in table), None)
    if key is None:
        return
    scattering, g = table.get("scattering_per_mm"), table[key]
    reduced = "mu_s (1 - g)"
    if isinstance(scattering, list | tuple):
        of_colours = g if isinstance(g, list | tuple) else [g] * len(scattering)
        pairs = list(zip(scattering, of_colours, strict=False))
        if all(type(number) in (int, float) for pair in pairs for number in pair):
            reduced = f"[{', '.join(f'{_reduced(*pair):.4g}' for pair in pairs)}]"
    expected = f"reduced scattering, mu_s' = mu_s (1 - g), and no {key}"
    advice = f"If its scattering is mu_s, as in MCML, write scattering_per_mm = {reduced}"
    refuse(culprit, expected, f"it has {key} = {format_value(g)}", f"{advice}; then take {key} out")


def refuse_mcml(path: Path) -> NoReturn:
    """Refuse an input or output file of MCML with the values of its layers in the units of this package.

    Source: [Wang1995] for the format: refractive index, absorption, scattering [1/cm], g and thickness [cm].
    """
    expected = "a .toml file with [[layers]] in 1/mm for red, green and blue"
    with open_regular_file(path, expected) as file:
        lines = file.read(_HEAD_BYTES).decode("latin-1").splitlines()
    rows = [_numbers(line.partition("#")[0].split()) for line in lines]
    layers = list(takewhile(lambda row: len(row) == 5, dropwhile(lambda row: len(row) != 5, rows)))
    values = [f"layer {k}: {_converted(*layer)}" for k, layer in enumerate(layers[:_MAX_LAYERS], 1)]
    actual = "it is of MCML, in 1/cm for one wavelength, and its scattering is not reduced"
    advice = "Write for each colour the reduced scattering, mu_s' = mu_s (1 - g)"
    refuse(path, expected, actual, "; ".join([advice, *values]))


def _converted(n: float, mu_a: float, mu_s: float, g: float, thickness_cm: float) -> str:
    """Return the keys and values of a layer of MCML in a file of this package."""
    thickness = (
        f"thickness_mm {10 * thickness_cm:.4g}"
        if 10 * thickness_cm <= _MAX_THICKNESS_MM
        else "no thickness_mm"
    )
    coefficients = f"absorption_per_mm {mu_a / 10:.4g}, scattering_per_mm {_reduced(mu_s, g) / 10:.4g}"
    return f"{coefficients}, {thickness}, eta {n:.4g}"


def _reduced(mu_s: float, g: float) -> float:
    return mu_s * (1.0 - g)


def _numbers(cells: list[str]) -> list[float]:
    """Return the numbers in cells of text; an empty list if any cell is not a number."""
    try:
        return [float(cell) for cell in cells]
    except ValueError:
        return []
