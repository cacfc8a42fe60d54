"""Clothing, glasses and headwear as plain data, which can also be given as words."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from dermis.base.errors import format_value, refuse
from dermis.base.reading import file_stamp
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
MHCLO_SUFFIX = ".mhclo"
"""Suffix of clothes of MakeHuman."""
NOTHING = "none"
"""Word for no garment, no glasses and no headwear."""
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


class Item:
    """Base class of what a person wears: conversion from and to words such as "navy denim shirt"."""

    @classmethod
    def _names_by_field(cls) -> dict[str, tuple[str, ...]]:
        """Return the names of each field that are recognised as words, in the order of `text`."""
        raise NotImplementedError

    @classmethod
    def coerce(cls, field_name: str, value: object) -> Self | None:
        """Convert words or a mapping of fields; items and None are returned unchanged, "none" becomes None.

        field_name : name of the field of `Human`, for error messages

        Raises DermisError for words and fields that the item does not have, and for other types.
        """
        if value is None or value == NOTHING:
            return None
        if isinstance(value, cls):
            return value
        if (file := cls._file_in(value)) is not None:
            return cls._from_file(file)
        if isinstance(value, str):
            return cls(**cls._parse(field_name, value))
        known = getattr(cls, "__dataclass_fields__", {})
        if not isinstance(value, Mapping) or set(value) - set(known):
            expected = f"a {cls.__name__}, words, or values of {', '.join(known)}"
            refuse(field_name, expected, f"got {format_value(value)}", "Correct it")
        return cls(**value)

    @classmethod
    def _file_in(cls, value: object) -> str | None:
        """Return the name of a file of clothes for this field in words or in a mapping; None without one."""
        return None

    @classmethod
    def _from_file(cls, file: str) -> Self:
        raise NotImplementedError

    @property
    def stamp(self) -> tuple[int, int] | None:
        """Return a value that changes when the file of an item does; None for items without a file."""
        return None

    @classmethod
    def _parse(cls, field_name: str, text: str) -> dict[str, Any]:
        """Return the fields that words in any order set; missing fields get their defaults."""
        found, rest = dict[str, Any](), f" {' '.join(text.replace(',', ' ').split())} "
        for name, words in cls._names_by_field().items():
            for word in sorted(words, key=len, reverse=True):
                if f" {word} " in rest:
                    found[name], rest = word, rest.replace(f" {word} ", " ", 1)
                    break
            if name == "colour" and name not in found and (hexadecimal := _HEX_COLOUR.search(rest)):
                found[name], rest = hexadecimal[0], rest.replace(hexadecimal[0], "", 1)
        if rest.strip() or not found:
            options = (f"{name} ({', '.join(words)})" for name, words in cls._names_by_field().items())
            expected = f"{NOTHING}, or words for {'; '.join(options)}"
            refuse(field_name, expected, f"got {rest.strip()!r}", "Correct it")
        return found

    @property
    def without_colour(self) -> Self:
        """Return the item in its default colour; items that differ only in colour have the same mesh."""
        fields = getattr(self, "__dataclass_fields__", {})
        return replace(self, colour=fields["colour"].default)  # type: ignore[type-var]

    @property
    def text(self) -> str:
        """Return the item as words that can be parsed, such as "navy denim shirt"."""
        return " ".join(str(getattr(self, name)) for name in self._names_by_field())


@dataclass(frozen=True)
class Clothing(Item):
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

    @classmethod
    def _names_by_field(cls) -> dict[str, tuple[str, ...]]:
        return {"colour": COLOURS, "cloth": CLOTH_NAMES, "garment": GARMENT_NAMES}

    @classmethod
    def _file_in(cls, value: object) -> str | None:
        if isinstance(value, Mapping):
            return str(value["file"]) if "file" in value else None
        return value if isinstance(value, str) and value.lower().endswith(MHCLO_SUFFIX) else None

    @classmethod
    def _from_file(cls, file: str) -> Any:
        return FileClothing(file=file)

    def __post_init__(self) -> None:
        """Replace a missing cloth by the usual one; raise DermisError for unknown names."""
        check_name("garment", self.garment, GARMENT_NAMES)
        if self.cloth is None:
            object.__setattr__(self, "cloth", GARMENT_CLOTHS[self.garment])
        check_name("cloth", self.cloth, CLOTH_NAMES)
        check_colour("colour", self.colour)


@dataclass(frozen=True)
class FileClothing(Clothing):
    """Garment of MakeHuman that the user has, for the parameter `clothing` of `Human`.

    Parameters
    ----------
    file : str
        Garment (.mhclo) for the base mesh hm08; parts below the bust are cut off. It has the colour of its
        material, or the mean colour of its texture.

    Raises
    ------
    DermisError
        For names without the suffix .mhclo; the file is read when a head is built.

    Examples
    --------
    >>> import dermis
    >>> dermis.Human(clothing="shirts/tshirt.mhclo").clothing.text
    'shirts/tshirt.mhclo'
    """

    file: str = ""

    def __post_init__(self) -> None:
        """Raise DermisError for names of other files."""
        if not isinstance(self.file, str) or Path(self.file).suffix.lower() != MHCLO_SUFFIX:
            refuse("clothing", f"a file of clothes ({MHCLO_SUFFIX})", f"got {self.file!r}", "Correct it")
        super().__post_init__()

    @property
    def without_colour(self) -> Self:
        """Return the item, whose colour is that of its file."""
        return self

    @property
    def stamp(self) -> tuple[int, int] | None:
        """Return time and size of the file; None for a missing file."""
        return file_stamp(self.file)

    @property
    def text(self) -> str:
        """Return the name of the file."""
        return self.file


GLASSES_COLOURS = {
    "round": "gold",
    "square": "black",
    "aviator": "gold",
    "rimless": "silver",
    "sunglasses": "black",
}
"""Usual colour of each frame."""
GLASSES_STYLES: tuple[str, ...] = tuple(GLASSES_COLOURS)


@dataclass(frozen=True)
class Glasses(Item):
    """Glasses or sunglasses.

    Parameters
    ----------
    style : {"round", "square", "aviator", "rimless", "sunglasses"}
        Frame. Round, aviator and rimless frames are of metal; aviators and sunglasses have dark lenses.
    colour : str, optional
        Name of the palette, such as "brown", or "#rrggbb" (sRGB); by default the usual colour of the frame.

    Raises
    ------
    DermisError
        For unknown styles and colours.

    Examples
    --------
    >>> import dermis
    >>> dermis.Human(glasses="brown square").glasses
    Glasses(style='square', colour='brown')
    """

    style: str = "square"
    colour: str = None  # type: ignore[assignment]  # `__post_init__` replaces None

    @classmethod
    def _names_by_field(cls) -> dict[str, tuple[str, ...]]:
        return {"colour": COLOURS, "style": GLASSES_STYLES}

    def __post_init__(self) -> None:
        """Replace a missing colour by the usual one; raise DermisError for unknown names."""
        check_name("style", self.style, GLASSES_STYLES)
        if self.colour is None:
            object.__setattr__(self, "colour", GLASSES_COLOURS[self.style])
        check_colour("colour", self.colour)


HEADWEAR_CLOTHS = {"cap": "cotton", "beanie": "wool", "turban": "linen", "headscarf": "cotton"}
"""Usual cloth of each kind of headwear."""
HEADWEAR_STYLES: tuple[str, ...] = tuple(HEADWEAR_CLOTHS)


@dataclass(frozen=True)
class Headwear(Item):
    """Headwear, under which hair is flat.

    Parameters
    ----------
    style : {"cap", "beanie", "turban", "headscarf"}
        Kind of headwear.
    cloth : {"cotton", "wool", "denim", "linen"}, optional
        Cloth, which determines weave and sheen; by default the usual cloth of the style.
    colour : str
        Name of the palette, such as "navy", or "#rrggbb" (sRGB).

    Raises
    ------
    DermisError
        For unknown styles, cloths and colours.

    Examples
    --------
    >>> import dermis
    >>> dermis.Human(headwear="red beanie").headwear
    Headwear(style='beanie', cloth='wool', colour='red')
    """

    style: str = "beanie"
    cloth: str = None  # type: ignore[assignment]  # `__post_init__` replaces None
    colour: str = "charcoal"

    @classmethod
    def _names_by_field(cls) -> dict[str, tuple[str, ...]]:
        return {"colour": COLOURS, "cloth": CLOTH_NAMES, "style": HEADWEAR_STYLES}

    def __post_init__(self) -> None:
        """Replace a missing cloth by the usual one; raise DermisError for unknown names."""
        check_name("style", self.style, HEADWEAR_STYLES)
        if self.cloth is None:
            object.__setattr__(self, "cloth", HEADWEAR_CLOTHS[self.style])
        check_name("cloth", self.cloth, CLOTH_NAMES)
        check_colour("colour", self.colour)


ITEM_TYPES: Mapping[str, type[Item]] = MappingProxyType(
    {"clothing": Clothing, "glasses": Glasses, "headwear": Headwear}
)
"""Types of items by field of `Human`."""
