"""Errors for files with unreduced scattering coefficients; their messages state the reduced coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import NoReturn

from dermis.base.errors import format_value, refuse
from dermis.base.reading import open_regular_file

MCML_SUFFIXES = (".mci", ".mco")
_ANISOTROPY_KEYS = ("g", "anisotropy")
_MCML_HEADER_BYTES = 1 << 16  # size of the beginning of an MCML file, which contains its layers
_MAX_LISTED_LAYERS = 6  # in a message
_MAX_LISTED_THICKNESS_MM = 1e4  # thicker layers of MCML files stand for semi-infinite ones


def check_reduced(error_subject: str, layer_entries: Mapping[str, object]) -> None:
    """Raise DermisError if a layer in a file has an entry for the anisotropy g.

    The scattering coefficient of such a layer is probably not yet multiplied by 1 - g.

    error_subject : name of the file or layer, for the message
    layer_entries : entries of the layer in the file, including "scattering_per_mm"
    """
    key = next((key for key in _ANISOTROPY_KEYS if key in layer_entries), None)
    if key is None:
        return
    scattering, g = layer_entries.get("scattering_per_mm"), layer_entries[key]
    reduced = "mu_s (1 - g)"
    if isinstance(scattering, list | tuple):
        anisotropies = g if isinstance(g, list | tuple) else [g] * len(scattering)
        pairs = list(zip(scattering, anisotropies, strict=False))
        if all(type(number) in (int, float) for pair in pairs for number in pair):
            reduced = f"[{', '.join(f'{_reduced_scattering(*pair):.4g}' for pair in pairs)}]"
    expected = f"reduced scattering, mu_s' = mu_s (1 - g), and no {key}"
    advice = f"If its scattering is mu_s, as in MCML, write scattering_per_mm = {reduced}"
    refuse(error_subject, expected, f"it has {key} = {format_value(g)}", f"{advice}; then take {key} out")


def refuse_mcml(path: Path) -> NoReturn:
    """Raise DermisError for an input or output file of the Monte Carlo program MCML.

    The message states the layers in the file, converted to the units of this package.

    Source: [Wang1995] for the format: refractive index, absorption, scattering [1/cm], g and thickness [cm].
    """
    expected = "a .toml file with [[layers]] in 1/mm for red, green and blue"
    with open_regular_file(path, expected) as file:
        lines = file.read(_MCML_HEADER_BYTES).decode("latin-1").splitlines()
    rows = [_parse_numbers(line.partition("#")[0].split()) for line in lines]
    layers = list(takewhile(lambda row: len(row) == 5, dropwhile(lambda row: len(row) != 5, rows)))
    values = [
        f"layer {k}: {_mcml_layer_text(*layer)}" for k, layer in enumerate(layers[:_MAX_LISTED_LAYERS], 1)
    ]
    actual = "it is of MCML, in 1/cm for one wavelength, and its scattering is not reduced"
    advice = "Write for each colour the reduced scattering, mu_s' = mu_s (1 - g)"
    refuse(path, expected, actual, "; ".join([advice, *values]))


def _mcml_layer_text(eta: float, mu_a: float, mu_s: float, g: float, thickness_cm: float) -> str:
    """Return a layer of MCML as text, with the keys and units of this package's TOML files.

    eta : index of refraction relative to air [-]
    mu_a, mu_s : absorption and scattering coefficient [1/cm]
    g : mean cosine of the scattering angle [-]
    thickness_cm : thickness of the layer [cm]
    """
    thickness = (
        f"thickness_mm {10 * thickness_cm:.4g}"
        if 10 * thickness_cm <= _MAX_LISTED_THICKNESS_MM
        else "no thickness_mm"
    )
    coefficients = (
        f"absorption_per_mm {mu_a / 10:.4g}, scattering_per_mm {_reduced_scattering(mu_s, g) / 10:.4g}"
    )
    return f"{coefficients}, {thickness}, eta {eta:.4g}"


def _reduced_scattering(mu_s: float, g: float) -> float:
    return mu_s * (1.0 - g)


def _parse_numbers(text_cells: list[str]) -> list[float]:
    """Return texts converted to numbers, or an empty list if any text is not a number."""
    try:
        return [float(cell) for cell in text_cells]
    except ValueError:
        return []
