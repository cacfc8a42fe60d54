"""What a person's hairs are like."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

from dermis.base.errors import refuse, shown_value
from dermis.base.quantities import check_numbers

Style = Literal["none", "cropped", "short"]
STYLES: tuple[Style, ...] = get_args(Style)
RANGES = {
    "length_mm": (1.0, 60.0),
    "beard_mm": (0.0, 30.0),
    "eumelanin": (0.0, 10.0),
    "pheomelanin": (0.0, 10.0),
    "seed": (0, 2**32 - 1),
}
"""Least and greatest values of fields that do not go from 0 to 1."""


@dataclass(frozen=True)
class HairLook:
    """Hair of the head, beard, brows and lashes.

    style : "none" for a bald or shaved head, "cropped" for hair of one length that stands up, "short" for
        hair that is combed to the side and shorter at the sides and the nape
    length_mm : of the hair of the head where it is longest, 1 to 60 [mm]
    density : of the hair of the head, 0 to 1; 1 is 200 hairs on a square centimetre [-]
    curl : from straight, 0, to tightly coiled, 1 [-]
    fade : how much shorter short hair is at the sides and the nape than on top, 0 to 1 [-]
    beard_mm : length of the beard, 0 for none, to 30 [mm]
    bushy : of brows, from 0, sparse and short, to 1, dense and long [-]
    grey : share of hairs without pigment, 0 to 1 [-]
    eumelanin, pheomelanin : concentrations from 0 to 10, see `dermis.specular.hair.absorption_per_mm` [-]
    seed : of what differs from hair to hair, any integer from 0
    """

    style: Style = "none"
    length_mm: float = 6.0
    density: float = 0.85
    curl: float = 0.1
    fade: float = 0.6
    beard_mm: float = 0.0
    bushy: float = 0.4
    grey: float = 0.0
    eumelanin: float = 4.0
    pheomelanin: float = 0.3
    seed: int = 0

    def __post_init__(self) -> None:
        if self.style not in STYLES:
            refuse("style", f"one of {', '.join(STYLES)}", f"{shown_value(self.style)} came", "Choose one")
        check_numbers(self, {field.name: RANGES.get(field.name, (0.0, 1.0)) for field in fields(self)[1:]})
