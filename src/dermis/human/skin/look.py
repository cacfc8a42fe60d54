"""Skin look (pigments, marks, folds) of a person, typical or sampled at random."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import check_fields
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE
from dermis.human.skin.measured import (
    MeasuredPigments,
    SiteDifferences,
    pigment_ancestry,
    sample_pigments,
    typical_pigments,
    typical_site_differences,
)
from dermis.mesh.eye_look import EyeLook
from dermis.optics.pigments.parameters import DEFAULT_SKIN

FIELD_RANGES: dict[str, tuple[float, float]] = {
    "seed": (0, 2**32 - 1),
    "epidermis_mm": (0.01, 0.5),
    "stubble_eumelanin": (0.0, 10.0),
    "stubble_pheomelanin": (0.0, 10.0),
}
"""Ranges of the numeric fields whose range is not 0 to 1."""
SITES_FIELD = "sites"
"""Name of the only field of `SkinLook` that is not a number."""
# Artist's values.
_TYPICAL_FRECKLES = {"african": 0.02, "asian": 0.06, "caucasian": 0.16}
_TYPICAL_IRIS_EUMELANIN = {"african": 0.95, "asian": 0.85, "caucasian": 0.4}
_NO_BLEMISHES_YEARS = 45.0  # age from which sampled people have no inflamed spots [years]
_AGE_SPOTS_FROM_YEARS = 45.0  # age from which there are age spots [years]
_FOLD_STRENGTH_AT_90_YEARS = 1.0  # `SkinLook.age` of people of 90 years


@dataclass(frozen=True)
class SkinLook:
    """Pigments and texture of the skin.

    The pigments are those of the cheek; `sites` states how the pigments of other parts of the head differ. By
    default, `Human` uses the medians of measured people.

    Parameters
    ----------
    melanin : float
        Volume fraction of melanosomes in the epidermis of the cheek, 0 to 1 [-].
    eumelanin : float
        Fraction of eumelanin in the melanosomes, 0 to 1 [-].
    blood : float
        Volume fraction of blood in the dermis of the cheek, 0 to 1 [-].
    oxygen : float
        Oxygen saturation of the cheek, 0 to 1 [-].
    epidermis_mm : float
        Thickness of the epidermis, 0.01 to 0.5 [mm].
    redness : float
        How much the blood content differs between parts of the face, 0 to 1; 0.5 is typical [-].
    freckles : float
        Density of freckles, 0 to 1 [-].
    moles : float
        Density of moles, 0 to 1 [-].
    spots : float
        Density of age spots on parts exposed to the sun, 0 to 1 [-].
    tan : float
        Darkening of parts exposed to the sun, 0 to 1; 0.3 is typical [-].
    veins : float
        Visibility of veins at temples, lids and neck, 0 to 1 [-].
    stubble : float
        Darkening of the scalp by hair of the head, shaved or not, 0 to 1 [-].
    recession : float
        Recession of the hair at temples, forehead and crown, 0 to 1 [-].
    beard : float
        Shadow of a shaved beard, 0 to 1 [-].
    oil : float
        Shininess, 0 to 1 [-].
    age : float
        Depth of folds and lines, from youth to old age, 0 to 1 [-].
    seed : int
        Seed of the pattern of spots and lines, 0 to 2**32 - 1.
    sites : SiteDifferences or mapping
        Differences in pigments between other sites of the head and the cheek; by default the medians of
        measured people.
    stubble_eumelanin, stubble_pheomelanin : float
        Concentrations of pigments in the hair that darkens the scalp, 0 to 10, see `HairLook` [-].
    blemishes : float
        Density of inflamed spots, 0 to 1 [-].
    scars : float
        Density of pitted scars of acne, 0 to 1 [-].
    vellus : float
        Density of vellus hair, which shines at the outline of the face in light from the side, 0 to 1;
        0 leaves it out, 0.5 is typical [-].

    Raises
    ------
    DermisError
        For values out of range.

    Examples
    --------
    >>> import dermis
    >>> dermis.SkinLook(freckles=0.8).freckles
    0.8
    """

    melanin: float = DEFAULT_SKIN.melanin
    eumelanin: float = DEFAULT_SKIN.eumelanin
    blood: float = DEFAULT_SKIN.blood
    oxygen: float = DEFAULT_SKIN.oxygen
    epidermis_mm: float = DEFAULT_SKIN.epidermis_mm
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
    sites: SiteDifferences = field(default_factory=typical_site_differences)
    stubble_eumelanin: float = 4.0
    stubble_pheomelanin: float = 0.3
    blemishes: float = 0.0
    scars: float = 0.0
    vellus: float = 0.0

    def __post_init__(self) -> None:
        """Raise DermisError for fields out of range."""
        names = (one.name for one in fields(self) if one.name != SITES_FIELD)
        check_fields(self, {name: FIELD_RANGES.get(name, (0.0, 1.0)) for name in names})
        object.__setattr__(self, SITES_FIELD, _checked_sites(self.sites))


def _checked_sites(site_differences: Any) -> SiteDifferences:
    """Convert a mapping, as read from a file, to `SiteDifferences`; return `SiteDifferences` unchanged."""
    known = [one.name for one in fields(SiteDifferences)]
    if isinstance(site_differences, Mapping) and site_differences.keys() <= set(known):
        return SiteDifferences(**site_differences)
    if not isinstance(site_differences, SiteDifferences):
        expected = f"differences of pigments for {', '.join(known)}"
        refuse(SITES_FIELD, expected, f"got {format_value(site_differences)}", "Correct it, or leave it out")
    return site_differences


class Demographics(NamedTuple):
    """Ancestry, sex and age of a person, from which typical looks of skin, eyes and hair are derived.

    african, asian, caucasian : ancestry fractions that determine the shape, which add up to 1
    sex : sex, from 0 (female) to 1 (male) [-]
    age : age [years]
    skin_groups : weight of each group of measured people in the colours of skin, eyes and hair, see
        `measured.group_weights`
    ita : individual typology angle (ITA) of the cheek [degrees]; None if it is not fixed
    """

    african: float
    asian: float
    caucasian: float
    sex: float
    age: float
    skin_groups: Mapping[str, float]
    ita: float | None = None

    def mean_over_shape_ancestry(self, value_of_ancestry: dict[str, float]) -> float:
        """Return the mean of values for three ancestries, weighted by the ancestry fractions of the shape."""
        return _weighted_mean((self.african, self.asian, self.caucasian), value_of_ancestry)

    def mean_over_skin_ancestry(self, value_of_ancestry: dict[str, float]) -> float:
        """Return the mean of values for three ancestries, weighted by the ancestry fractions of the skin."""
        return _weighted_mean(pigment_ancestry(self.skin_groups), value_of_ancestry)


def _weighted_mean(fractions: tuple[float, float, float], value_of_ancestry: dict[str, float]) -> float:
    names = "african", "asian", "caucasian"
    return sum(fraction * value_of_ancestry[name] for fraction, name in zip(fractions, names, strict=True))


def typical_skin(demographics: Demographics) -> SkinLook:
    """Return the typical skin look for a person's ancestry, age and sex, with pigments of measured people.

    Source: [Lu2025] for the pigments.
    """
    return _typical_skin_look(demographics, *typical_pigments(*_typical_pigment_arguments(demographics)))


def _typical_skin_look(
    demographics: Demographics, pigments: MeasuredPigments, site_differences: SiteDifferences
) -> SkinLook:
    """Return the typical skin look of a person whose pigments are known.

    pigments : pigments of the person's cheek
    site_differences : pigments at other sites of the head minus the pigments at the cheek
    """
    old = (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    spot_progress = max(demographics.age - _AGE_SPOTS_FROM_YEARS, 0.0) / (OLD_AGE - _AGE_SPOTS_FROM_YEARS)
    return SkinLook(
        **pigments._asdict(),
        freckles=demographics.mean_over_skin_ancestry(_TYPICAL_FRECKLES),
        moles=0.3,
        spots=0.7 * spot_progress * (0.4 + 0.6 * pigment_ancestry(demographics.skin_groups)[2]),
        veins=0.2 + 0.5 * old,
        beard=0.45 * max(2.0 * demographics.sex - 1.0, 0.0),
        oil=0.45 - 0.25 * old,
        age=0.04 + (_FOLD_STRENGTH_AT_90_YEARS - 0.04) * old**1.5,
        sites=site_differences,
    )


def _typical_pigment_arguments(
    demographics: Demographics,
) -> tuple[Mapping[str, float], float, float, float | None]:
    return demographics.skin_groups, demographics.sex, demographics.age, demographics.ita


def typical_eyes(demographics: Demographics) -> EyeLook:
    """Return the typical eye look: brown irises, lighter for a larger fraction of European ancestry."""
    redness = 0.15 + 0.2 * (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    return EyeLook(eumelanin=demographics.mean_over_skin_ancestry(_TYPICAL_IRIS_EUMELANIN), redness=redness)


def sample_eyes(rng: np.random.Generator, demographics: Demographics) -> EyeLook:
    """Return a random eye look around the typical look; Europeans have irises of all colours."""
    typical = typical_eyes(demographics)
    spread = 0.08 + 0.28 * pigment_ancestry(demographics.skin_groups)[2]
    eumelanin = _clamp(typical.eumelanin + spread * rng.normal(), 0.0, 1.0)
    pupil, seed = float(rng.uniform(1.4, 2.6)), int(rng.integers(2**31))
    return EyeLook(eumelanin, pupil, _clamp(typical.redness + 0.1 * rng.normal(), 0.0, 1.0), seed)


def sample_skin(
    rng: np.random.Generator, pigment_rng: np.random.Generator, demographics: Demographics
) -> SkinLook:
    """Return a random skin look of a person, with pigments that are distributed as in measured people.

    rng : random generator for marks, folds, tan and shine
    pigment_rng : random generator for the pigments of the cheek and of other sites of the head, and for
        blemishes and scars

    Source: [Lu2025] for the pigments.
    """
    pigments, sites = sample_pigments(pigment_rng, *_typical_pigment_arguments(demographics))
    typical = _typical_skin_look(demographics, pigments, sites)
    blemishes, scars = pigment_rng.beta(0.5, 4.0), pigment_rng.beta(0.25, 5.0)
    n = rng.normal(size=8)
    freckled = float(rng.beta(0.4, 3.0)) * (1.0 - min(typical.melanin / 0.1, 1.0))
    seed = int(rng.integers(2**31))
    male = max(2.0 * demographics.sex - 1.0, 0.0)
    return replace(
        typical,
        redness=_clamp(0.5 + 0.15 * n[3], 0.1, 1.0),
        freckles=_clamp(0.5 * typical.freckles + 0.9 * freckled, 0.0, 1.0),
        moles=_clamp(typical.moles + 0.15 * n[4], 0.0, 1.0),
        spots=_clamp(typical.spots * (1.0 + 0.4 * n[5]), 0.0, 1.0),
        tan=float(rng.uniform(0.0, 0.6)),
        stubble=float(rng.uniform(0.2, 0.9)),
        beard=male * float(rng.uniform(0.05, 0.9)),
        oil=_clamp(typical.oil + 0.12 * n[6], 0.05, 0.9),
        age=_clamp(typical.age * (1.0 + 0.2 * n[7]), 0.0, 1.0),
        blemishes=float(blemishes) * _clamp((_NO_BLEMISHES_YEARS - demographics.age) / 20.0, 0.0, 1.0),
        scars=float(scars),
        seed=seed,
    )


def _clamp(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))
