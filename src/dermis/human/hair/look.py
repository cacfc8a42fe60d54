"""Hair look (style, length, density, colour) of a person, typical or sampled at random."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
import numpy as np

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import check_fields
from dermis.human.hair.styles import styles
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE
from dermis.human.skin.look import Demographics

HAIR_STYLES: tuple[str, ...] = ("none", *styles())
FIELD_RANGES = {
    "length_mm": (1.0, 500.0),
    "beard_mm": (0.0, 30.0),
    "eumelanin": (0.0, 10.0),
    "pheomelanin": (0.0, 10.0),
    "seed": (0, 2**32 - 1),
}
"""Ranges of the fields whose range is not 0 to 1."""
# Artist's values.
_TYPICAL_CURL = {"african": 0.95, "asian": 0.0, "caucasian": 0.2}
_CROPPED_CURL = 0.6  # curl above which hair is cropped
_CROPPED_LENGTH_MM, _SHORT_LENGTH_MM, _SHORT_MALE_LENGTH_MM = 6.0, 32.0, 27.0
_MAX_BEARD_MM = 14.0
_DARK_EUMELANIN = 3.0  # eumelanin above which shaved hair has full visibility


@dataclass(frozen=True)
class HairLook:
    """Hair of the head, beard, brows and lashes.

    Parameters
    ----------
    style : {"none", "cropped", "short"}
        "none" for a bald or shaved head, "cropped" for hair of equal length that stands up, "short" for hair
        combed to the side and shorter at the sides and the nape.
    length_mm : float
        Length of the hair of the head where it is longest, 1 to 60 [mm].
    density : float
        Density of the hair of the head, 0 to 1; 1 is 200 hairs per cm2 [-].
    curl : float
        From straight, 0, to tightly coiled, 1 [-].
    fade : float
        How much shorter short hair is at the sides and the nape than on top, 0 to 1 [-].
    beard_mm : float
        Length of the beard, 0 to 30; 0 for none [mm].
    bushy : float
        Brows, from sparse and short, 0, to dense and long, 1 [-].
    grey : float
        Fraction of hairs without pigment, 0 to 1 [-].
    eumelanin, pheomelanin : float
        Concentrations of pigments, 0 to 10, see `dermis.specular.hair.absorption_per_mm` [-].
    seed : int
        Seed of the variation between hairs, 0 to 2**32 - 1.

    Raises
    ------
    DermisError
        For an unknown style and for values out of range.

    Examples
    --------
    >>> import dermis
    >>> dermis.HairLook(style="short", length_mm=30).beard_mm
    0.0
    """

    style: str = "none"
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
        """Raise DermisError for an unknown style and for fields out of range."""
        if self.style not in HAIR_STYLES:
            refuse(
                "style", f"one of {', '.join(HAIR_STYLES)}", f"got {format_value(self.style)}", "Choose one"
            )
        check_fields(
            self, {field.name: FIELD_RANGES.get(field.name, (0.0, 1.0)) for field in fields(self)[1:]}
        )


def typical_hair(demographics: Demographics, eumelanin: float, pheomelanin: float) -> HairLook:
    """Return the typical hair look for a person's ancestry, age and sex.

    eumelanin, pheomelanin : pigment concentrations of the hair, see `HairLook`
    """
    old = (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    curl = demographics.weighted_mean(_TYPICAL_CURL)
    tight = curl > _CROPPED_CURL
    short_mm = _SHORT_LENGTH_MM + (_SHORT_MALE_LENGTH_MM - _SHORT_LENGTH_MM) * demographics.sex
    return HairLook(
        style="cropped" if tight else "short",
        length_mm=_CROPPED_LENGTH_MM if tight else short_mm,
        density=0.9 - 0.25 * old,
        curl=curl,
        fade=0.55 + 0.3 * demographics.sex,
        bushy=min(1.0, 0.25 + 0.5 * demographics.sex + 0.25 * old * demographics.sex),
        grey=max(0.0, 0.9 * old - 0.25),
        eumelanin=eumelanin,
        pheomelanin=pheomelanin,
    )


def sample_hair(rng: np.random.Generator, demographics: Demographics, typical: HairLook) -> HairLook:
    """Return a random hair look around the typical one of a person.

    Men have cropped or shaved hair more often than women, and only men have beards. The order of random draws
    does not depend on the person.
    """
    n, style_chance, beard_chance = rng.normal(size=4), rng.random(), rng.random()
    man = demographics.sex > 0.5
    hairless_below, cropped_below = (0.12, 0.5) if man else (0.03, 0.25)
    curl = float(np.clip(typical.curl + 0.12 * n[0], 0.0, 1.0))
    style = "short"
    length = typical.length_mm if typical.style == "short" else _SHORT_LENGTH_MM
    if style_chance < hairless_below:
        style = "none"
    elif style_chance < cropped_below or typical.curl > _CROPPED_CURL:
        style, length = "cropped", _CROPPED_LENGTH_MM
    length *= float(np.exp((0.3 if style == "cropped" else 0.15) * n[1]))
    beard = float(np.exp(rng.uniform(np.log(0.8), np.log(_MAX_BEARD_MM))))
    return replace(
        typical,
        style=style,
        length_mm=float(np.clip(length, 2.0, 45.0)),
        density=float(np.clip(typical.density + 0.08 * n[2], 0.3, 1.0)),
        curl=curl,
        fade=float(np.clip(typical.fade + 0.12 * n[3], 0.0, 1.0)),
        beard_mm=beard if man and beard_chance < 0.5 else 0.0,
        seed=int(rng.integers(2**31)),
    )


def sample_recession(rng: np.random.Generator, demographics: Demographics) -> float:
    """Return a random recession of the hairline for `SkinLook`, 0 to 1, which increases with age in men."""
    old = (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    man = max(2.0 * demographics.sex - 1.0, 0.0)
    return float(np.clip(man * rng.beta(1.2, 1.8) * (0.15 + 1.1 * old), 0.0, 1.0))


def stubble_visibility(hair: HairLook) -> float:
    """Return the visibility of shaved hair below the skin: from 0.15 for white hair to 1 for dark hair."""
    return min(1.0, 0.15 + (hair.eumelanin + 0.3 * hair.pheomelanin) * (1.0 - hair.grey) / _DARK_EUMELANIN)
