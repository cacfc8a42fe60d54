"""The look of a skin: pigments and texture, and looks drawn at random."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from dermis.base.quantities import check_fields
from dermis.human.makehuman import OLD, YOUNG
from dermis.mesh.eye_look import EyeLook
from dermis.optics.pigments.parameters import DEFAULT_SKIN

RANGES = {"seed": (0, 2**32 - 1)}
"""Least and greatest values of fields that do not go from 0 to 1."""
# Artist's values; that melanin differs so much between peoples, and how it is spread, is common knowledge.
_MELANIN = {"african": 0.19, "asian": 0.024, "caucasian": 0.010}
_EUMELANIN = {"african": 0.85, "asian": 0.7, "caucasian": 0.65}
_FRECKLES = {"african": 0.02, "asian": 0.06, "caucasian": 0.16}
_IRIS = {"african": 0.95, "asian": 0.85, "caucasian": 0.4}
_MELANIN_LOG_DEVIATION = 0.42  # standard deviation of the melanin's logarithm within a people
_EUMELANIN_STEP = 0.05  # of eumelanin: people share tables of colours
_AGE_SPOTS_FROM = 45.0
_MAX_AGE_FOLDS = 1.0  # of `age` at 90


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
        check_fields(self, {field.name: RANGES.get(field.name, (0.0, 1.0)) for field in fields(self)})


class Demographics(NamedTuple):
    """What of a person its skin goes with.

    african, asian, caucasian : shares of the ancestries that add up to 1
    sex : 0 female, 1 male
    age : [years]
    """

    african: float
    asian: float
    caucasian: float
    sex: float
    age: float

    def weighted_mean(self, values: dict[str, float]) -> float:
        """Of values by ancestry."""
        african, asian, caucasian = (values[name] for name in ("african", "asian", "caucasian"))
        return self.african * african + self.asian * asian + self.caucasian * caucasian


def typical_skin(demographics: Demographics) -> SkinLook:
    """The skin that goes with a person: by ancestry, age and sex."""
    old = (demographics.age - YOUNG) / (OLD - YOUNG)
    lines = max(demographics.age - _AGE_SPOTS_FROM, 0.0) / (OLD - _AGE_SPOTS_FROM)
    return SkinLook(
        melanin=math.exp(
            demographics.weighted_mean({name: math.log(share) for name, share in _MELANIN.items()})
        ),
        eumelanin=demographics.weighted_mean(_EUMELANIN),
        blood=0.009,
        freckles=demographics.weighted_mean(_FRECKLES),
        moles=0.3,
        spots=0.7 * lines * (0.4 + 0.6 * demographics.caucasian),
        veins=0.2 + 0.5 * old,
        beard=0.45 * max(2.0 * demographics.sex - 1.0, 0.0),
        oil=0.45 - 0.25 * old,
        age=0.04 + (_MAX_AGE_FOLDS - 0.04) * old**1.5,
    )


def typical_eyes(demographics: Demographics) -> EyeLook:
    """The eyes that go with a person: brown, lighter the more of the ancestry is European."""
    return EyeLook(
        eumelanin=demographics.weighted_mean(_IRIS),
        redness=0.15 + 0.2 * (demographics.age - YOUNG) / (OLD - YOUNG),
    )


def sample_eyes(rng: np.random.Generator, demographics: Demographics) -> EyeLook:
    """Eyes at random around the usual ones: among Europeans of all colours."""
    typical = typical_eyes(demographics)
    spread = 0.08 + 0.28 * demographics.caucasian
    eumelanin = _clamp(typical.eumelanin + spread * rng.normal(), 0.0, 1.0)
    pupil, seed = float(rng.uniform(1.4, 2.6)), int(rng.integers(2**31))
    return EyeLook(eumelanin, pupil, _clamp(typical.redness + 0.1 * rng.normal(), 0.0, 1.0), seed)


def sample_skin(rng: np.random.Generator, demographics: Demographics) -> SkinLook:
    """A skin at random around the usual one, by numbers that are always drawn in the same order."""
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
