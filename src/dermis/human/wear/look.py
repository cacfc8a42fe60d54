"""What a person wears: clothing, as plain data."""

from __future__ import annotations

import re
from dataclasses import dataclass

from dermis.base.errors import format_value, refuse
from dermis.human.wear.fabrics import CLOTHS, COLOURS

GARMENT_CLOTHS = {
    "crew neck": "cotton",
    "v-neck": "cotton",
    "high neck": "wool",
    "shirt": "cotton",
    "hoodie": "cotton",
}
"""Usual cloth of each garment."""
GARMENT_NAMES: tuple[str, ...] = tuple(GARMENT_CLOTHS)
CLOTH_NAMES: tuple[str, ...] = tuple(CLOTHS)
_HEX_COLOUR = re.compile("#[0-9a-fA-F]{6}")


def check_name(field_name: str, value: object, names: tuple[str, ...]) -> None:
    """Raise DermisError for a value that is not one of the given names."""
    if value not in names:
        refuse(field_name, f"one of {', '.join(names)}", f"got {format_value(value)}", "Choose one")


def check_colour(field_name: str, value: object) -> None:
    """Raise DermisError for a value that is neither a colour of the palette nor "#rrggbb"."""
    if value not in COLOURS and not (isinstance(value, str) and _HEX_COLOUR.fullmatch(value)):
        expected = f"one of {', '.join(COLOURS)}, or #rrggbb"
        refuse(field_name, expected, f"got {format_value(value)}", "Choose a colour")


@dataclass(frozen=True)
class Clothing:
    """Garment of the upper body.

    Parameters
    ----------
    garment : {"crew neck", "v-neck", "high neck", "shirt", "hoodie"}
        Cut of the garment.
    cloth : {"cotton", "wool", "denim", "linen"}, optional
        Cloth, which determines weave, sheen and folds; by default the usual cloth of the garment.
    colour : str
        Name of the palette, such as "navy", or "#rrggbb" (sRGB).

    Raises
    ------
    DermisError
        For unknown garments, cloths and colours.

    Examples
    --------
    >>> import dermis
    >>> dermis.Clothing("shirt", colour="white").cloth
    'cotton'
    """

    garment: str = "crew neck"
    cloth: str = None  # type: ignore[assignment]  # `__post_init__` replaces None
    colour: str = "navy"

    def __post_init__(self) -> None:
        """Replace a missing cloth by the usual one; raise DermisError for unknown names."""
        check_name("garment", self.garment, GARMENT_NAMES)
        if self.cloth is None:
            object.__setattr__(self, "cloth", GARMENT_CLOTHS[self.garment])
        check_name("cloth", self.cloth, CLOTH_NAMES)
        check_colour("colour", self.colour)
