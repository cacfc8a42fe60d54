"""Descriptions of a skin's colour: CIELAB, hue, individual typology angle (ITA) and classes of two scales."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.arrays import Doubles
from dermis.images.colour import decode_srgb, delta_e_2000, lab

SKIN_CLASS_DISCLAIMER = (
    "ITA and the nearest classes describe this colour, not a person, ancestry or risk of sunburn"
)
"""Statement that users see beside the numbers."""
_ITA_CENTRE_LIGHTNESS = 50.0  # L* of the pivot of the angle
_MONK_SRGB = (
    "f6ede4", "f3e7db", "f7ead0", "eadaba", "d7bd96", "a07e56", "825c43", "604134", "3a312a", "292420",
)  # fmt: skip
_MIN_ITA_OF_FITZPATRICK_TYPES = (("I", 55.0), ("II", 41.0), ("III", 28.0), ("IV", 10.0), ("V", -30.0))
"""Fitzpatrick types, each with a limit: the individual typology angle (ITA) of its colours is larger than
this limit [degrees]. Type VI has no limit."""


class SkinTone(NamedTuple):
    """Description of a skin colour under D65, without surface reflection.

    L, a, b : CIELAB coordinates
    hue_degrees : hue angle, arctan(b / a) [degrees]
    ita_degrees : individual typology angle, arctan((L - 50) / b) [degrees]
    monk : nearest class of the Monk Skin Tone Scale by CIEDE2000, 1 (lightest) to 10
    fitzpatrick : Fitzpatrick type, I to VI, whose range of ITA contains the ITA of the colour

    Source: [Chardon1991] for the ITA and ranges of ITA, [DelBino2013] for the type of each range, [Monk2019]
    for the Monk Skin Tone Scale.
    """

    L: float
    a: float
    b: float
    hue_degrees: float
    ita_degrees: float
    monk: int
    fitzpatrick: str

    def as_json(self) -> dict[str, float | int | str]:
        """Return the description with rounded numbers and a note that it describes a colour, not a person."""
        values = {name: round(one, 2) for name, one in zip(self._fields[:5], self[:5], strict=True)}
        return {
            **values,
            "monk": self.monk,
            "fitzpatrick": self.fitzpatrick,
            "statement": SKIN_CLASS_DISCLAIMER,
        }

    def as_text(self) -> str:
        """Return the description as a line of text."""
        numbers = f"L* {self.L:.1f}, a* {self.a:.1f}, b* {self.b:.1f}, hue {self.hue_degrees:.0f}°"
        nearest = f"nearest Monk {self.monk}, Fitzpatrick {self.fitzpatrick}"
        return f"{numbers}, ITA {self.ita_degrees:.0f}°, {nearest}"


def ita_degrees(cielab: ArrayLike) -> Doubles:
    """Return the individual typology angle (...) of CIELAB colours (..., 3) [degrees].

    In the plane of b* and L*, the individual typology angle is the angle of a colour about the point
    b* = 0, L* = 50. It is from 90 (light) to -90 (dark). Colours with negative b*, which skin does not have,
    get 90 or -90.

    Source: [Chardon1991].
    """
    L, _, b = np.moveaxis(np.asarray(cielab, np.float64), -1, 0)
    return np.asarray(np.degrees(np.arctan2(L - _ITA_CENTRE_LIGHTNESS, np.maximum(b, 1e-6))))


def hue_degrees(cielab: ArrayLike) -> Doubles:
    """Return the hue angle (...) of CIELAB colours (..., 3), from -180 to 180 [degrees]."""
    _, a, b = np.moveaxis(np.asarray(cielab, np.float64), -1, 0)
    return np.asarray(np.degrees(np.arctan2(b, a)))


def skin_tone(linear_colour: ArrayLike) -> SkinTone:
    """Return the description of a skin colour.

    linear_colour : (3,) diffuse reflectance, linear Rec. 709 [-]
    """
    colour = np.asarray(linear_colour, np.float64)
    L, a, b = (float(one) for one in lab(colour))
    ita = float(ita_degrees((L, a, b)))
    monk = 1 + int(np.argmin(delta_e_2000(_monk_colours(), colour)))
    fitzpatrick = next((name for name, lowest in _MIN_ITA_OF_FITZPATRICK_TYPES if ita > lowest), "VI")
    return SkinTone(L, a, b, float(hue_degrees((L, a, b))), ita, monk, fitzpatrick)


@cache
def _monk_colours() -> Doubles:
    """Return the colours (10, 3) of the Monk Skin Tone Scale, linear Rec. 709 [-]."""
    levels = np.array([[int(code[k : k + 2], 16) for k in (0, 2, 4)] for code in _MONK_SRGB])
    return np.asarray(decode_srgb(levels / 255.0), np.float64)
