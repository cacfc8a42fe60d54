"""Hair look (style, length, density, colour) of a person, typical or sampled at random."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import check_fields
from dermis.human.hair.styles import Style, beard_styles, styles
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE
from dermis.human.skin.look import Demographics

HAIR_STYLES: tuple[str, ...] = ("none", *styles())
BEARD_STYLES: tuple[str, ...] = ("none", *beard_styles())
FIELD_RANGES = {
    "length_mm": (1.0, 500.0),
    "diameter_mm": (0.03, 0.12),
    "curl_radius_mm": (0.0, 20.0),
    "curl_pitch_mm": (4.0, 300.0),
    "clump_mm": (2.0, 40.0),
    "frizz_mm": (0.0, 5.0),
    "parting_mm": (-60.0, 60.0),
    "beard_mm": (0.0, 150.0),
    "eumelanin": (0.0, 10.0),
    "pheomelanin": (0.0, 10.0),
    "dye_eumelanin": (0.0, 10.0),
    "dye_pheomelanin": (0.0, 10.0),
    "roots_mm": (0.0, 500.0),
    "seed": (0, 2**32 - 1),
}
"""Ranges of the numeric fields whose range is not 0 to 1."""
_NAMES_BY_FIELD = {"style": HAIR_STYLES, "beard_style": BEARD_STYLES}
# Artist's values.
_TYPICAL_CURL = {"african": 0.95, "asian": 0.0, "caucasian": 0.2}
_MIN_TIGHT_CURL = 0.6  # curl above which hair is worn in the styles of tightly coiled hair
_BALD_CHANCE_BY_SEX = {
    False: 0.01,
    True: 0.1,
}  # of women and of men; those of the styles are in styles.toml
_FALLBACK_STYLE = Style("up", max_length_mm=500.0, length_mm=6.0)
_MAX_SAMPLED_BEARD_MM = 14.0
_FULL_BEARD = "full"
_BEARD_CHANCES = (("goatee", 0.06), ("moustache", 0.10), (_FULL_BEARD, 0.5))
"""Artist's values: cumulative chances of beard styles among men. Short "full" beards look like stubble."""
_ADDED_FIELDS_STREAM = 3  # random stream of fields added later, so that older fields keep their samples
_DARK_EUMELANIN = 3.0  # eumelanin above which shaved hair has full visibility


@dataclass(frozen=True)
class HairLook:
    """Hair of the head, beard, brows and lashes.

    Parameters
    ----------
    style : str
        "none" for a bald or shaved head, or a style from `HAIR_STYLES`, such as "cropped", "short", "long",
        "bob", "afro" or "ponytail"; the gallery shows them all.
    length_mm : float, optional
        Length of the hair of the head where it is longest, from 1 to the maximum of the style; by default
        the usual length of the style [mm].
    density : float
        Density of the hair of the head, 0 to 1; 1 is 200 hairs per cm2 [-].
    diameter_mm : float
        Mean diameter of the hairs of the head, 0.03 (fine) to 0.12 (coarse) [mm].
    curl : float
        Curl, from 0 (straight) to 1 (tightly coiled) [-].
    curl_radius_mm : float, optional
        Radius of the curls, 0 to 20; by default it follows from `curl` [mm].
    curl_pitch_mm : float, optional
        Length of a hair per turn of its curl, 4 to 300; by default it follows from `curl` [mm].
    curl_coherence : float, optional
        Agreement of the phases of curls, from 0 (random for each hair) to 1 (waves run across neighbouring
        hairs); by default it follows from `curl` [-].
    clump : float, optional
        Strength with which hairs are drawn to the middle of their clump, 0 to 1; by default that of the
        style [-].
    clump_mm : float, optional
        Size of the clumps at the roots, 2 to 40; by default that of the style. A new size costs up to a
        second, because clumps are computed for it and then cached [mm].
    frizz_mm : float, optional
        Amplitude of the random displacement of hairs, 0 to 5; by default it follows from `curl` [mm].
    flyaways : float
        Fraction of hairs that are displaced much more than others, 0 to 1 [-].
    parting_mm : float, optional
        Distance of the parting from the middle, positive to the left, -60 to 60; by default that of the
        style. Has an effect only in styles with a parting. A new position costs up to a second [mm].
    widows_peak : float
        How far the middle of the hairline reaches down the forehead, from 0 (rounded) to 1 [-].
    baby_hairs : float
        Fraction of short fine hairs along the hairline, 0 to 1 [-].
    fade : float, optional
        How much shorter hair is at the sides and the nape than on top, 0 to 1; by default the usual fade of
        the style. Has no effect in styles that have no fade [-].
    beard_style : str
        "none", or a style from `BEARD_STYLES`: "stubble", "short", "full", "moustache" or "goatee".
    beard_mm : float, optional
        Length of the beard, 0 to 150; 0 for none; by default the usual length of the beard style. A length
        without a style gives a full beard [mm].
    bushy : float
        Bushiness of the brows, from 0 (sparse and short) to 1 (dense and long) [-].
    grey : float
        Fraction of hairs without pigment, 0 to 1 [-].
    temple_grey : float
        Additional fraction of hairs without pigment at the temples and in sideburns, 0 to 1 [-].
    eumelanin, pheomelanin : float
        Concentrations of pigments, 0 to 10, see `dermis.specular.hair.absorption_per_mm` [-].
    dye_eumelanin, dye_pheomelanin : float, optional
        Concentrations of pigments in dyed hair of the head, 0 to 10; None for hair that is not dyed. If only
        one of them is given, the other is 0 [-].
    roots_mm : float
        Length of hair in the natural colour that has grown since the hair was dyed, 0 to 500 [mm].
    seed : int
        Seed of the variation between hairs, 0 to 2**32 - 1.

    Raises
    ------
    DermisError
        For an unknown style, for values out of range, and for hair longer than its style allows.

    Examples
    --------
    >>> import dermis
    >>> dermis.HairLook(style="short", length_mm=30).beard_mm
    0.0
    """

    style: str = "none"
    length_mm: float = None  # type: ignore[assignment]  # `__post_init__` replaces None
    density: float = 0.85
    curl: float = 0.1
    fade: float = None  # type: ignore[assignment]
    beard_mm: float = None  # type: ignore[assignment]
    bushy: float = 0.4
    grey: float = 0.0
    eumelanin: float = 4.0
    pheomelanin: float = 0.3
    seed: int = 0
    diameter_mm: float = 0.068
    curl_radius_mm: float | None = None
    curl_pitch_mm: float | None = None
    curl_coherence: float | None = None
    clump: float | None = None
    clump_mm: float | None = None
    frizz_mm: float | None = None
    flyaways: float = 0.012
    parting_mm: float | None = None
    widows_peak: float = 0.0
    baby_hairs: float = 0.5
    beard_style: str = "none"
    temple_grey: float = 0.0
    dye_eumelanin: float | None = None
    dye_pheomelanin: float | None = None
    roots_mm: float = 0.0

    def __post_init__(self) -> None:
        """Replace a missing length or fade by the usual value of the style, and complete the beard.

        Raises DermisError for an unknown style, for values out of range, and for hair too long for its style.
        """
        for name, names in _NAMES_BY_FIELD.items():
            if getattr(self, name) not in names:
                actual = f"got {format_value(getattr(self, name))}"
                refuse(name, f"one of {', '.join(names)}", actual, "Choose one")
        style = styles().get(self.style, _FALLBACK_STYLE)
        for name in ("length_mm", "fade"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, getattr(style, name))
        if self.beard_mm is None:
            usual = beard_styles().get(self.beard_style)
            object.__setattr__(self, "beard_mm", usual.length_mm if usual else 0.0)
        optional = {field.name for field in fields(self) if field.default is None}
        numbers = (field.name for field in fields(self) if field.name not in _NAMES_BY_FIELD)
        given = (name for name in numbers if getattr(self, name) is not None or name not in optional)
        check_fields(self, {name: FIELD_RANGES.get(name, (0.0, 1.0)) for name in given})
        if (self.beard_mm == 0.0) != (self.beard_style == "none"):
            object.__setattr__(self, "beard_style", _FULL_BEARD if self.beard_mm else "none")
        if self.length_mm > style.max_length_mm:
            limit, longest = (
                f"at most {style.max_length_mm:g} mm for the style {self.style}",
                max(styles(), key=lambda name: styles()[name].max_length_mm),
            )
            refuse("length_mm", limit, f"got {self.length_mm:g}", f"Choose another style, such as {longest}")


def typical_hair(demographics: Demographics, eumelanin: float, pheomelanin: float) -> HairLook:
    """Return the typical hair look for a person's ancestry, age and sex.

    eumelanin, pheomelanin : pigment concentrations of the hair, see `HairLook`
    """
    old = (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    curl, woman = demographics.mean_over_shape_ancestry(_TYPICAL_CURL), demographics.sex < 0.5
    loose, tight = ("shoulder-length", "afro") if woman else ("short", "cropped")
    return HairLook(
        style=tight if curl > _MIN_TIGHT_CURL else loose,
        density=0.9 - 0.25 * old,
        curl=curl,
        bushy=min(1.0, 0.25 + 0.5 * demographics.sex + 0.25 * old * demographics.sex),
        grey=max(0.0, 0.9 * old - 0.25),
        eumelanin=eumelanin,
        pheomelanin=pheomelanin,
    )


def sample_hair(rng: np.random.Generator, demographics: Demographics, typical: HairLook) -> HairLook:
    """Return a random hair look around the typical hair look of a person.

    The probabilities of the styles are chosen, not measured; they are in styles.toml. Only men have beards.
    """
    n, style_chance, beard_chance = rng.normal(size=4), rng.random(), rng.random()
    man = demographics.sex > 0.5
    curl = float(np.clip(typical.curl + 0.12 * n[0], 0.0, 1.0))
    name = _pick_style(style_chance, man, curl > _MIN_TIGHT_CURL)
    style = styles().get(name, _FALLBACK_STYLE)
    length = style.length_mm * float(np.exp(0.2 * n[1]))
    beard = float(np.exp(rng.uniform(np.log(0.8), np.log(_MAX_SAMPLED_BEARD_MM))))
    beard_style = next((name for name, chance in _BEARD_CHANCES if man and beard_chance < chance), "none")
    seed = int(rng.integers(2**31))
    extra = np.random.default_rng((seed, _ADDED_FIELDS_STREAM)).random(4)
    return replace(
        typical,
        style=name,
        length_mm=float(np.clip(length, 1.0, style.max_length_mm)),
        density=float(np.clip(typical.density + 0.08 * n[2], 0.3, 1.0)),
        curl=curl,
        fade=float(np.clip(style.fade + 0.12 * n[3], 0.0, 1.0)) if style.fade else 0.0,
        beard_style=beard_style,
        beard_mm=0.0 if beard_style == "none" else beard if beard_style == _FULL_BEARD else beard + 3.0,
        seed=seed,
        diameter_mm=float(typical.diameter_mm * np.exp(0.3 * (extra[0] - 0.5))),
        widows_peak=float(max(0.0, 2.0 * extra[1] - 1.0)),
        baby_hairs=float(0.25 + 0.6 * extra[2]),
        temple_grey=float(min(1.0, 1.5 * typical.grey) * extra[3]),
    )


def restyled_fields(hair: HairLook, style_name: str) -> dict[str, Any]:
    """Return `length_mm` and `fade` of a hair look in another style.

    The ratio of its length to the usual length of the style is kept, within the limits of the new style.

    style_name : name of the new style; the result is empty for an unknown name
    """
    if style_name not in styles():
        return {}
    usual, style = styles().get(hair.style, _FALLBACK_STYLE), styles()[style_name]
    length_mm = style.length_mm * hair.length_mm / max(usual.length_mm, 1.0)
    return {"length_mm": float(np.clip(length_mm, 1.0, style.max_length_mm)), "fade": style.fade}


def _pick_style(uniform_sample: float, is_man: bool, is_tightly_coiled: bool) -> str:
    """Return the name of a random hair style, with the probabilities in styles.toml.

    uniform_sample : uniformly distributed random number, 0 to 1, which selects the style
    is_man : whether the person is a man
    is_tightly_coiled : whether the hair is tightly coiled
    """
    worn = {name: one for name, one in styles().items() if (one.tight if is_tightly_coiled else one.loose)}
    chances = np.array(
        [_BALD_CHANCE_BY_SEX[is_man], *(one.men if is_man else one.women for one in worn.values())]
    )
    index = int(np.searchsorted(np.cumsum(chances) / chances.sum(), uniform_sample, side="right"))
    return ("none", *worn)[min(index, len(worn))]


def sample_recession(rng: np.random.Generator, demographics: Demographics) -> float:
    """Return a random recession of the hairline for `SkinLook`, 0 to 1, which increases with age in men."""
    old = (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    man = max(2.0 * demographics.sex - 1.0, 0.0)
    return float(np.clip(man * rng.beta(1.2, 1.8) * (0.15 + 1.1 * old), 0.0, 1.0))


def scalp_shadow_fields(hair: HairLook, shaved_strength: float) -> dict[str, Any]:
    """Return the fields of `SkinLook` that describe how the hair of the head darkens the scalp.

    shaved_strength : strength of this effect for shaved hair, 0 to 1; for other hair it follows from its
        density
    """
    strength = (
        shaved_strength * stubble_visibility(hair) if hair.style == "none" else 0.55 + 0.45 * hair.density
    )
    pigmented = 1.0 - hair.grey
    return {
        "stubble": strength,
        "stubble_eumelanin": pigmented * hair.eumelanin,
        "stubble_pheomelanin": pigmented * hair.pheomelanin,
    }


def stubble_visibility(hair: HairLook) -> float:
    """Return how visible shaved hair is below the skin, from 0.15 for white hair to 1 for dark hair."""
    return min(1.0, 0.15 + (hair.eumelanin + 0.3 * hair.pheomelanin) * (1.0 - hair.grey) / _DARK_EUMELANIN)
