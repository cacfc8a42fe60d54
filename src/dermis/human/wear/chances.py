"""Chances of clothing, glasses and headwear of random people; the numbers are chosen, not measured."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dermis.human.wear.look import Clothing, Glasses, Headwear, Item

SAMPLED = "sampled"
"""Word for an item that follows from the seed of a random person."""
_STREAM = 6  # of random numbers; other streams of a seed give shape, skin, eyes and hair
_CLOTHED_CHANCE = 0.98
# Weights of garments of women and of men.
_GARMENTS = {
    "crew neck": (0.38, 0.38),
    "v-neck": (0.20, 0.08),
    "shirt": (0.18, 0.26),
    "hoodie": (0.12, 0.18),
    "high neck": (0.12, 0.10),
}
_OTHER_CLOTHS = {
    "crew neck": "wool",
    "v-neck": "wool",
    "shirt": "denim",
    "hoodie": "cotton",
    "high neck": "wool",
}
_OTHER_CLOTH_CHANCE = 0.25
_COLOURS = {
    "white": 2.0,
    "grey": 2.0,
    "charcoal": 2.0,
    "black": 2.5,
    "navy": 2.5,
    "blue": 1.2,
    "sky": 1.0,
    "indigo": 0.8,
    "cream": 0.8,
    "beige": 0.8,
    "olive": 0.7,
    "green": 0.6,
    "teal": 0.5,
    "burgundy": 0.7,
    "red": 0.6,
    "pink": 0.5,
    "mustard": 0.4,
    "brown": 0.5,
}
# Chance of glasses with clear lenses at ages, and of dark ones at all ages.
_GLASSES_AGES, _GLASSES_CHANCES, _DARK_CHANCE = (25.0, 45.0, 65.0), (0.25, 0.4, 0.6), 0.03
_CLEAR_FRAMES, _DARK_FRAMES = (
    {"square": 0.45, "round": 0.3, "rimless": 0.25},
    {"sunglasses": 0.7, "aviator": 0.3},
)
_ACETATE_COLOURS = {"black": 0.5, "brown": 0.3, "navy": 0.1, "burgundy": 0.1}
_HEADWEAR_CHANCE = 0.12
# Weights of headwear of women and of men.
_HEADWEAR = {"cap": (0.3, 0.5), "beanie": (0.35, 0.35), "headscarf": (0.3, 0.03), "turban": (0.05, 0.12)}


def sampled_items(seed: int, sex: float, age: float) -> dict[str, Item | None]:
    """Return what the random person of a seed wears by field of `Human`; None for a field without an item.

    sex : sex of the person, 0 (female) to 1 (male)
    age : age of the person [years]
    """
    rng = np.random.default_rng((seed, _STREAM))
    is_clothed, has_other_cloth = rng.random(2) < (_CLOTHED_CHANCE, _OTHER_CLOTH_CHANCE)
    garment, colour = _pick(rng, _by_sex(_GARMENTS, sex)), _pick(rng, _COLOURS)
    glasses_chance = float(np.interp(age, _GLASSES_AGES, _GLASSES_CHANCES))
    eyewear, clear, dark, frame_colour = (
        rng.random(),
        _pick(rng, _CLEAR_FRAMES),
        _pick(rng, _DARK_FRAMES),
        _pick(rng, _ACETATE_COLOURS),
    )
    frame = dark if eyewear < _DARK_CHANCE else clear
    is_acetate = frame in ("square", "sunglasses")
    wears_hat, hat = rng.random() < _HEADWEAR_CHANCE, _pick(rng, _by_sex(_HEADWEAR, sex))
    hat_colour = _pick(rng, _COLOURS)
    cloth = _OTHER_CLOTHS[garment] if has_other_cloth else None
    return {
        "clothing": Clothing(garment, cloth, colour) if is_clothed else None,  # type: ignore[arg-type]  # usual cloth
        "glasses": Glasses(frame, frame_colour if is_acetate else None)  # type: ignore[arg-type]  # usual colour
        if eyewear < _DARK_CHANCE + glasses_chance
        else None,
        "headwear": Headwear(hat, colour=hat_colour) if wears_hat else None,
    }


def _by_sex(weights: Mapping[str, tuple[float, float]], sex: float) -> dict[str, float]:
    return {name: (1.0 - sex) * women + sex * men for name, (women, men) in weights.items()}


def _pick(rng: np.random.Generator, weights: Mapping[str, float]) -> str:
    """Return a random name, with probabilities proportional to weights."""
    ends = np.cumsum(list(weights.values()))
    index = int(np.searchsorted(ends, rng.random() * ends[-1], "right"))
    return list(weights)[min(index, len(weights) - 1)]
