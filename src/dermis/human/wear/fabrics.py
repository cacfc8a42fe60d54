"""Cloths and colours of clothing and glasses; the numbers are chosen by eye."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from dermis.human.wear.folds import Folds
from dermis.images.colour import decode_srgb
from dermis.mesh.fabric import Fabric


class Cloth(NamedTuple):
    """Cloth of a garment: its appearance and its folds.

    fabric, trim : appearance of the body of a garment, and of its knitted bands
    folds : heights of its folds
    roughness : perceptual roughness of the fibres [-]
    """

    fabric: Fabric
    trim: Fabric
    folds: Folds
    roughness: float


CLOTHS: Mapping[str, Cloth] = {
    "cotton": Cloth(
        Fabric("jersey", 0.9, 0.22, 0.06, 0.05, 0.03),
        Fabric("rib", 2.2, 0.36, 0.10, 0.05, 0.0),
        Folds(5.0, 4.5, 4.5, 0.7),
        0.86,
    ),
    "wool": Cloth(
        Fabric("jersey", 3.6, 0.26, 0.14, 0.16, 0.0),
        Fabric("rib", 4.6, 0.36, 0.14, 0.16, 0.0),
        Folds(4.0, 4.5, 5.5, 0.2),
        0.9,
    ),
    "denim": Cloth(
        Fabric("twill", 1.1, 0.45, 0.55, 0.02, 0.07),
        Fabric("twill", 1.1, 0.45, 0.55, 0.02, 0.03),
        Folds(5.5, 6.0, 4.0, 0.9),
        0.82,
    ),
    "linen": Cloth(
        Fabric("plain", 0.9, 0.40, 0.22, 0.04, 0.16),
        Fabric("plain", 0.9, 0.40, 0.22, 0.04, 0.08),
        Folds(5.5, 5.0, 5.0, 1.8),
        0.84,
    ),
}
"""Cloths by name."""

_COLOURS = {
    "white": "#e8e6e1",
    "cream": "#e3d8c0",
    "grey": "#9a9b9d",
    "charcoal": "#44474c",
    "black": "#1f2023",
    "navy": "#232f4b",
    "blue": "#35598f",
    "sky": "#93b5d4",
    "indigo": "#3a4d6f",
    "teal": "#2c6e72",
    "green": "#3d6b48",
    "olive": "#6a6a3d",
    "yellow": "#dcb84a",
    "mustard": "#b98a34",
    "orange": "#c7693a",
    "red": "#a92f30",
    "burgundy": "#61222e",
    "pink": "#d49aa2",
    "purple": "#5c4673",
    "brown": "#6b4c39",
    "beige": "#bfa987",
    "gold": "#dcbd8b",
    "silver": "#c9c9cb",
}
COLOURS: tuple[str, ...] = tuple(_COLOURS)
"""Names of the colours of clothing and glasses."""


def linear_colour(colour: str) -> tuple[float, float, float]:
    """Return the albedo of a colour of the palette or of "#rrggbb" (sRGB), linear Rec. 709 [-]."""
    digits = _COLOURS.get(colour, colour).lstrip("#")
    red, green, blue = decode_srgb([int(digits[k : k + 2], 16) / 255.0 for k in (0, 2, 4)]).tolist()
    return red, green, blue
