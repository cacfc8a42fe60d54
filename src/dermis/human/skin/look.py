"""Skin look (pigments, marks, folds) of a person, typical or sampled at random."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from dermis.base.quantities import check_fields
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE
from dermis.mesh.eye_look import EyeLook
from dermis.optics.pigments.parameters import DEFAULT_SKIN

FIELD_RANGES = {"seed": (0, 2**32 - 1)}
"""Ranges of the fields whose range is not 0 to 1."""
# Artist's values.
_TYPICAL_MELANIN = {"african": 0.19, "asian": 0.024, "caucasian": 0.010}
_TYPICAL_EUMELANIN = {"african": 0.85, "asian": 0.7, "caucasian": 0.65}
_TYPICAL_FRECKLES = {"african": 0.02, "asian": 0.06, "caucasian": 0.16}
_TYPICAL_IRIS = {"african": 0.95, "asian": 0.85, "caucasian": 0.4}
_MELANIN_LOG_DEVIATION = 0.42  # standard deviation of log melanin within an ancestry
_EUMELANIN_STEP = 0.05  # rounding, so that people share colour tables
_AGE_SPOTS_FROM = 45.0
_MAX_AGE_FOLDS = 1.0  # `age` of the look at an age of 90


@dataclass(frozen=True)
class SkinLook:
    """Pigments and texture of the skin.

    The epidermis has the default thickness; absorption depends on melanin times thickness.

    Parameters
    ----------
    melanin : float
        Volume fraction of melanosomes in the epidermis, mean over the head, 0 to 1 [-].
    eumelanin : float
        Fraction of eumelanin in the melanosomes, 0 to 1 [-].
    blood : float
        Volume fraction of blood in the dermis, mean over the head, 0 to 1 [-].
    oxygen : float
        Oxygen saturation, 0 to 1 [-].
    redness : float
        Additional blood in the naturally red parts of the face, 0 to 1; 0.5 is typical [-].
    freckles : float
        Density of freckles, 0 to 1 [-].
    moles : float
        Density of moles, 0 to 1 [-].
    spots : float
        Density of age spots on parts exposed to the sun, 0 to 1 [-].
    tan : float
        Darkening of parts exposed to the sun, 0 to 1 [-].
    veins : float
        Visibility of veins at temples, lids and neck, 0 to 1 [-].
    stubble : float
        Shadow of the shaved hair of the head, 0 to 1 [-].
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
        """Raise DermisError for fields out of range."""
        check_fields(self, {field.name: FIELD_RANGES.get(field.name, (0.0, 1.0)) for field in fields(self)})


class Demographics(NamedTuple):
    """Ancestry, sex and age of a person, from which typical looks of skin, eyes and hair are derived.

    african, asian, caucasian : fractions of the ancestries, with a sum of 1
    sex : from 0, female, to 1, male [-]
    age : age [years]
    """

    african: float
    asian: float
    caucasian: float
    sex: float
    age: float

    def weighted_mean(self, values: dict[str, float]) -> float:
        """Return the mean of one value per ancestry, weighted by the ancestry fractions."""
        african, asian, caucasian = (values[name] for name in ("african", "asian", "caucasian"))
        return self.african * african + self.asian * asian + self.caucasian * caucasian


def typical_skin(demographics: Demographics) -> SkinLook:
    """Return the typical skin look for a person's ancestry, age and sex."""
    old = (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    log_melanin = {name: math.log(fraction) for name, fraction in _TYPICAL_MELANIN.items()}
    lines = max(demographics.age - _AGE_SPOTS_FROM, 0.0) / (OLD_AGE - _AGE_SPOTS_FROM)
    return SkinLook(
        melanin=math.exp(demographics.weighted_mean(log_melanin)),
        eumelanin=demographics.weighted_mean(_TYPICAL_EUMELANIN),
        blood=0.009,
        freckles=demographics.weighted_mean(_TYPICAL_FRECKLES),
        moles=0.3,
        spots=0.7 * lines * (0.4 + 0.6 * demographics.caucasian),
        veins=0.2 + 0.5 * old,
        beard=0.45 * max(2.0 * demographics.sex - 1.0, 0.0),
        oil=0.45 - 0.25 * old,
        age=0.04 + (_MAX_AGE_FOLDS - 0.04) * old**1.5,
    )


def typical_eyes(demographics: Demographics) -> EyeLook:
    """Return the typical eye look: brown irises, which are lighter with more European ancestry."""
    redness = 0.15 + 0.2 * (demographics.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
    return EyeLook(eumelanin=demographics.weighted_mean(_TYPICAL_IRIS), redness=redness)


def sample_eyes(rng: np.random.Generator, demographics: Demographics) -> EyeLook:
    """Return a random eye look around the typical one; European ancestry gives irises of all colours."""
    typical = typical_eyes(demographics)
    spread = 0.08 + 0.28 * demographics.caucasian
    eumelanin = _clamp(typical.eumelanin + spread * rng.normal(), 0.0, 1.0)
    pupil, seed = float(rng.uniform(1.4, 2.6)), int(rng.integers(2**31))
    return EyeLook(eumelanin, pupil, _clamp(typical.redness + 0.1 * rng.normal(), 0.0, 1.0), seed)


def sample_skin(rng: np.random.Generator, demographics: Demographics) -> SkinLook:
    """Return a random skin look around the typical one of a person.

    The order of random draws does not depend on the person.
    """
    typical = typical_skin(demographics)
    n = rng.normal(size=8)
    freckled = float(rng.beta(0.4, 3.0)) * (1.0 - min(typical.melanin / 0.1, 1.0))
    seed = int(rng.integers(2**31))
    male = max(2.0 * demographics.sex - 1.0, 0.0)
    return SkinLook(
        melanin=_clamp(typical.melanin * math.exp(_MELANIN_LOG_DEVIATION * n[0]), 0.002, 0.45),
        eumelanin=round(_clamp(typical.eumelanin + 0.05 * n[1], 0.4, 0.95) / _EUMELANIN_STEP)
        * _EUMELANIN_STEP,
        blood=_clamp(typical.blood * math.exp(0.2 * n[2]), 0.004, 0.018),
        redness=_clamp(0.5 + 0.15 * n[3], 0.1, 1.0),
        freckles=_clamp(0.5 * typical.freckles + 0.9 * freckled, 0.0, 1.0),
        moles=_clamp(typical.moles + 0.15 * n[4], 0.0, 1.0),
        spots=_clamp(typical.spots * (1.0 + 0.4 * n[5]), 0.0, 1.0),
        tan=float(rng.uniform(0.0, 0.6)),
        veins=typical.veins,
        stubble=float(rng.uniform(0.2, 0.9)),
        beard=male * float(rng.uniform(0.05, 0.9)),
        oil=_clamp(typical.oil + 0.12 * n[6], 0.05, 0.9),
        age=_clamp(typical.age * (1.0 + 0.2 * n[7]), 0.0, 1.0),
        seed=seed,
    )


def _clamp(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))
