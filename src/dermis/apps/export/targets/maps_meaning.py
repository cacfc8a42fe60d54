"""What each exported map holds, in which unit, and how a PNG shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Shown = Literal["colour", "light", "normal", "share", "range", "root", "none"]
"""How a PNG holds a map: sRGB of 8 bits; the same of light, divided by its 99.9th percentile; a normal n as
(n + 1) / 2 in 16 bits; a share in 16 bits; 16 bits from the least to the largest value; the square root in
16 bits; not at all."""


@dataclass(frozen=True)
class Meaning:
    """Of a map.

    unit : of its numbers in OpenEXR, empty for none
    shown : how a PNG has it
    words : what it is
    """

    unit: str
    shown: Shown
    words: str


MEANINGS: Mapping[str, Meaning] = MappingProxyType(
    {
        "albedo": Meaning(
            "", "colour", "share of the light that comes back from below the surface, Rec. 709"
        ),
        "normal": Meaning("", "normal", "normal with the relief in tangent space: x along +u, z outwards"),
        "height": Meaning("mm", "range", "relief outwards, from an arbitrary zero; the normal's own"),
        "roughness": Meaning("", "root", "Beckmann m, with the relief that is finer than a texel"),
        "rho_s": Meaning("", "share", "factor of the surface's reflection"),
        "reflected": Meaning("", "share", "share of light from everywhere that the rough surface takes"),
        "melanin": Meaning("", "share", "share of the epidermis' volume"),
        "blood": Meaning("", "share", "share of the dermis' volume"),
        "thickness": Meaning("mm", "range", "of the flesh below, as far as light is followed"),
        "curvature": Meaning("1/mm", "range", "root mean square of the principal curvatures, smoothed"),
        "stretch": Meaning("mm", "none", "length on the skin of the maps' width and of their height; R, G"),
        "irradiance": Meaning("irradiance", "light", "light that enters the skin, before it spreads"),
        "scattered": Meaning(
            "irradiance",
            "light",
            "light that leaves, after it spread: pi times the radiance along the normal",
        ),
    }
)
"""By the maps' names, which are those of their files."""
