"""What makes one skin look different from another."""

from __future__ import annotations

from dataclasses import dataclass, fields

from dermis.base.quantities import check_numbers
from dermis.optics.pigments.parameters import DEFAULT_SKIN

RANGES = {"seed": (0, 2**32 - 1)}
"""Least and greatest values of fields that do not go from 0 to 1."""


@dataclass(frozen=True)
class SkinLook:
    """Pigments and texture of a skin.

    melanin : share of the epidermis' volume that is melanosomes, as a mean over the head, 0 to 1 [-]
    eumelanin : share of the melanosomes that hold eumelanin, 0 to 1 [-]
    blood : share of the dermis' volume that is blood, as a mean over the head, 0 to 1 [-]
    oxygen : share of the haemoglobin that carries oxygen, 0 to 1 [-]
    redness : how much more blood is where faces are red than elsewhere, 0 to 1; 0.5 is usual [-]
    freckles : from none to a face full of them, 0 to 1 [-]
    moles : from none to many, 0 to 1 [-]
    spots : of age, where the sun shines, 0 to 1 [-]
    tan : how much darker skin is that the sun has seen than that under clothes, 0 to 1 [-]
    veins : how much they shine through at temples, lids and neck, 0 to 1 [-]
    stubble : shadow of the shaved hair of the head, from bald to dark, 0 to 1 [-]
    recession : how far that hair has left temples, forehead and crown, 0 to 1 [-]
    beard : shadow of a shaved beard, 0 to 1 [-]
    oil : how much the skin shines, 0 to 1 [-]
    age : depth of folds and lines, from youth to old age, 0 to 1 [-]
    seed : which spots and lines, any integer from 0

    The epidermis is as thick as the default skin's; absorption goes with melanin times thickness.
    """

    melanin: float = DEFAULT_SKIN.melanin
    eumelanin: float = DEFAULT_SKIN.eumelanin
    blood: float = DEFAULT_SKIN.blood
    oxygen: float = DEFAULT_SKIN.oxygen
    redness: float = 0.5
    freckles: float = 0.1
    moles: float = 0.3
    spots: float = 0.0
    tan: float = 0.3
    veins: float = 0.3
    stubble: float = 0.7
    recession: float = 0.0
    beard: float = 0.0
    oil: float = 0.4
    age: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        check_numbers(self, {field.name: RANGES.get(field.name, (0.0, 1.0)) for field in fields(self)})
