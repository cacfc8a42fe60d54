"""Fields of random people: ancestry, sex, age, build, shape of the face, skin, eyes and hair."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.quantities import checked_integer
from dermis.human.hair.look import (
    HairLook,
    restyled_fields,
    sample_hair,
    sample_recession,
    scalp_shadow_fields,
    stubble_visibility,
    typical_hair,
)
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE, human_targets
from dermis.human.proportions import with_proportions
from dermis.human.skin.look import Demographics, SkinLook, sample_eyes, sample_skin
from dermis.human.skin.measured import (
    GROUPS_OF_ANCESTRY,
    group_probabilities,
    group_weights,
    pigment_ancestry,
)
from dermis.human.wear.chances import SAMPLED, sampled_items
from dermis.human.wear.look import ITEM_TYPES

_MAX_SEED = 2**32 - 1
_MIN_BEARD_SHADOW = 0.6  # shadow of shaved hair below a beard
_ANCESTRY_CONCENTRATION = 0.35  # of a Dirichlet distribution; small, so that mostly one ancestry prevails
_SEX_SD = 0.08  # standard deviation of `sex` from 0 or 1
_OPPOSITE_SUFFIXES = {"decr": "incr", "down": "up", "in": "out", "backward": "forward", "concave": "convex"}
"""Pairs of suffixes; two targets whose names differ only by such a pair have opposite effects."""
_WEIGHT_SD_BY_FOLDER = {  # standard deviation of the weights of targets by folder
    "head": 0.1,
    "forehead": 0.25,
    "eyebrows": 0.25,
    "eyes": 0.15,
    "nose": 0.22,
    "mouth": 0.18,
    "cheek": 0.25,
    "chin": 0.22,
    "ears": 0.25,
    "neck": 0.12,
}
# Words in the names of targets for macro quantities and for shifts of whole parts, which are not sampled:
_EXCLUDED_TARGETS = ("trans", "age", "fat", "measure", "push")
_RELATIVE_SIDE_DIFFERENCE_SD = 0.2  # of the difference between left and right, relative to that of the weight
_ASYMMETRY_SD = 0.1
_HEAD_SHAPES = ("diamond", "invertedtriangular", "oval", "rectangular", "round", "square", "triangular")
_MAX_HEAD_SHAPE_WEIGHT = 0.3
ANCESTRIES = "african", "asian", "caucasian"
_NESTED_FIELDS = "targets", "skin", "eyes", "hair"
_OPTIONAL_FIELDS = ("ita", "skin_ancestry", *ITEM_TYPES)
# fraction of Caucasian shapes that have one of `_OTHER_SKIN_ANCESTRIES`, if no ancestry is given
_OTHER_SKIN_ANCESTRY_FRACTION = 0.45
_OTHER_SKIN_ANCESTRIES = ("south asian", "iraqi", "arabian")
# Dirichlet parameters of African, Asian, Caucasian shape by skin group; artist's values
_SHAPE_CONCENTRATIONS_OF_SKIN = {
    "african": (3.0, 0.05, 0.05),
    "caucasian": (0.05, 0.05, 3.0),
    "chinese": (0.05, 3.0, 0.05),
    "japanese": (0.05, 3.0, 0.05),
    "southeast asian": (0.1, 3.0, 0.1),
    "south asian": (0.5, 0.5, 3.0),
    "iraqi": (0.3, 0.1, 3.0),
    "arabian": (0.4, 0.1, 3.0),
}


def sample_fields(seed: int, fixed_fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a random `Human` as a dictionary from field name to value.

    fixed_fields : values of fields that are not sampled
    """
    for name in _NESTED_FIELDS:
        value = fixed_fields.get(name, {})
        if not isinstance(value, Mapping):
            expected, actual = "a dictionary of the fields that are not sampled", type(value).__name__
            refuse(name, expected, f"got a {actual}", f"Or use dataclasses.replace(person, {name}=...)")
    excluded = *_NESTED_FIELDS, *_OPTIONAL_FIELDS
    fixed_numbers = {name: float(value) for name, value in fixed_fields.items() if name not in excluded}
    rng = np.random.default_rng(checked_integer("seed", seed, 0, _MAX_SEED))
    sampled = rng.dirichlet((_ANCESTRY_CONCENTRATION,) * 3)
    ancestry, groups = _sample_ancestry(
        np.random.default_rng((int(seed), 3)), fixed_numbers, sampled, fixed_fields
    )
    sex = min(abs(rng.normal(0.0, _SEX_SD)), 0.3)
    sex = fixed_numbers.get("sex", 1.0 - sex if rng.random() < 0.5 else sex)
    old = rng.beta(1.2, 2.2)
    old = (fixed_numbers["age"] - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE) if "age" in fixed_numbers else old
    weight = rng.normal(0.3 * old - 0.1, 0.25)
    muscle = rng.normal(0.2 * sex - 0.1 - 0.3 * old, 0.2)
    fields: dict[str, Any] = {
        "sex": float(sex),
        "age": float(YOUNG_AGE + (OLD_AGE - YOUNG_AGE) * old),
        "weight": float(np.clip(weight, -0.7, 0.8)),
        "muscle": float(np.clip(muscle, -0.6, 0.6)),
        "targets": {
            **with_proportions(np.random.default_rng((int(seed), 5)), dict(_sample_targets(rng))),
            **fixed_fields.get("targets", {}),
        },
    }
    fields |= dict(zip(ANCESTRIES, map(float, ancestry), strict=True)) | fixed_numbers
    african, asian, caucasian = ancestry
    demographics = Demographics(
        african, asian, caucasian, fields["sex"], fields["age"], groups, fixed_fields.get("ita")
    )
    skin = sample_skin(rng, np.random.default_rng((int(seed), 4)), demographics)
    eyes = sample_eyes(rng, demographics)
    hair_ancestry = np.array(pigment_ancestry(groups))
    brown, red = _sample_hair_pigments(np.random.default_rng((int(seed), 1)), hair_ancestry)
    colour = {"hair_eumelanin": brown, "hair_pheomelanin": red} | fixed_numbers
    fields |= colour | {"eyes": replace(eyes, **fixed_fields.get("eyes", {}))}
    fields |= {name: fixed_fields[name] for name in _OPTIONAL_FIELDS if fixed_fields.get(name) is not None}
    if SAMPLED in (fields.get(name) for name in ITEM_TYPES):
        items = sampled_items(int(seed), fields["sex"], fields["age"])
        fields |= {name: item for name, item in items.items() if fields.get(name) == SAMPLED}
    typical = typical_hair(demographics, colour["hair_eumelanin"], colour["hair_pheomelanin"])
    hair_rng = np.random.default_rng((int(seed), 2))
    return fields | _sample_hair_and_skin(hair_rng, demographics, typical, skin, fixed_fields)


def _ancestry_fractions(
    fixed_fields: Mapping[str, float], sampled_fractions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ancestry fractions (3,) from fixed weights, or the sampled fractions if no weights are fixed.

    fixed_fields : values of fields that are not sampled; may contain weights of ancestries
    sampled_fractions : (3,) sampled ancestry fractions
    """
    if not any(name in fixed_fields for name in ANCESTRIES):
        return sampled_fractions
    weights = np.array([fixed_fields.get(name, 0.0) for name in ANCESTRIES])
    if not weights.sum() > 0:
        refuse("ancestry", "a weight of african, asian or caucasian above 0", "all given are 0", "Raise one")
    return np.asarray(weights / weights.sum())


def _sample_ancestry(
    rng: np.random.Generator,
    fixed_numbers: Mapping[str, float],
    sampled_fractions: NDArray[np.float64],
    fixed_fields: Mapping[str, Any],
) -> tuple[NDArray[np.float64], dict[str, float]]:
    """Sample the ancestry of a person, in one form for the shape of the head and in another for the skin.

    For the shape, returns the fractions (3,) of African, Asian and Caucasian ancestry. For the skin, returns
    a dictionary from the name of each group of measured people to the weight of its pigments in the average.

    If the ancestry of the shape is fixed, the skin follows the shape. If only a skin ancestry or an ITA is
    fixed, the shape follows the skin. If nothing is fixed, the skin follows the shape, too, except that some
    people of Caucasian shape get South Asian or Middle Eastern skin.

    fixed_numbers : values of numeric fields that are not sampled
    sampled_fractions : (3,) sampled ancestry fractions of the shape
    fixed_fields : values of all fields that are not sampled
    """
    picks, chance = rng.random(3), rng.random()
    ancestry, shape_given = (
        _ancestry_fractions(fixed_numbers, sampled_fractions),
        any(name in fixed_numbers for name in ANCESTRIES),
    )
    name = str(fixed_fields.get("skin_ancestry") or "")
    if name or (fixed_fields.get("ita") is not None and not shape_given):
        group = _pick_name(
            group_weights(0, 0, 0, name) if name else group_probabilities(float(fixed_fields["ita"])),
            picks[0],
        )
        shape = ancestry if shape_given else rng.dirichlet(_SHAPE_CONCENTRATIONS_OF_SKIN[group])
        return shape, {group: 1.0}
    groups: dict[str, float] = {}
    for fraction, people, pick in zip(ancestry, ANCESTRIES, picks, strict=True):
        other = people == "caucasian" and not shape_given and chance < _OTHER_SKIN_ANCESTRY_FRACTION
        names = _OTHER_SKIN_ANCESTRIES if other else GROUPS_OF_ANCESTRY.get(people, (people,))
        groups[names[min(int(pick * len(names)), len(names) - 1)]] = float(fraction)
    return ancestry, groups


def _pick_name(weight_of_name: Mapping[str, float], uniform_sample: float) -> str:
    """Return a random name, with probabilities proportional to weights.

    weight_of_name : weight of each name
    uniform_sample : uniformly distributed random number, 0 to 1, which selects the name
    """
    ends = np.cumsum(list(weight_of_name.values()))
    return list(weight_of_name)[
        min(int(np.searchsorted(ends, uniform_sample, "right")), len(weight_of_name) - 1)
    ]


def _sample_hair_and_skin(
    rng: np.random.Generator,
    demographics: Demographics,
    typical_look: HairLook,
    skin: SkinLook,
    fixed_fields: Mapping[str, Any],
) -> dict[str, Any]:
    """Return a random hair look and a skin look with matching stubble and recession, as fields of `Human`.

    demographics : ancestry, sex and age of the person
    typical_look : typical hair look of the person
    skin : sampled skin look, whose stubble, beard shadow and recession are replaced
    fixed_fields : values of fields that are not sampled
    """
    hair, recession = sample_hair(rng, demographics, typical_look), sample_recession(rng, demographics)
    fixed = dict(fixed_fields.get("hair", {}))
    if "style" in fixed:
        fixed = restyled_fields(hair, str(fixed["style"])) | fixed
    if "beard_style" in fixed:
        fixed.setdefault("beard_mm", None)  # the usual length of the style
    hair = replace(hair, **fixed)
    visibility = stubble_visibility(hair)
    beard = visibility * max(skin.beard, _MIN_BEARD_SHADOW if hair.beard_mm else 0.0)
    skin = replace(skin, **scalp_shadow_fields(hair, skin.stubble), beard=beard, recession=recession)
    return {"hair": hair, "skin": replace(skin, **fixed_fields.get("skin", {}))}


def _sample_hair_pigments(rng: np.random.Generator, ancestry: NDArray[np.float64]) -> tuple[float, float]:
    """Return random amounts of eumelanin and pheomelanin in hair.

    Hair of people without European ancestry is nearly black.

    ancestry : (3,) fractions of African, Asian and European ancestry
    """
    fair = np.exp(rng.uniform(np.log(0.4), np.log(5.0)))
    brown = float(np.exp(ancestry @ np.log([8.0, 7.0, fair])) * rng.lognormal(0.0, 0.1))
    red = float(ancestry[2] * rng.exponential(0.35) + 0.1)
    return min(brown, 10.0), min(red, 4.0)


def _sample_targets(rng: np.random.Generator) -> Iterator[tuple[str, float]]:
    """Yield names of morph targets of the face with random weights; of two opposite targets, only one."""
    common: dict[str, float] = {}
    samples = iter(
        rng.standard_normal(sum(1 + bool(one.shared_name) for one in _opposite_targets())).tolist()
    )
    for one in _opposite_targets():
        value = one.spread * next(samples)
        if one.truncated:
            value = min(max(value, -2 * one.spread), 2 * one.spread)
        if one.shared_name:  # left and right are nearly alike
            value = common.setdefault(
                one.shared_name, value
            ) + _RELATIVE_SIDE_DIFFERENCE_SD * one.spread * next(samples)
        yield (one.more if value > 0 else one.less), abs(value)
    yield f"head/head-{rng.choice(_HEAD_SHAPES)}", float(rng.uniform(0.0, _MAX_HEAD_SHAPE_WEIGHT))


class _OppositeTargets(NamedTuple):
    """Two morph targets with opposite effects, and the normal distribution of their signed weight.

    less, more : names of the targets for negative and positive weights
    spread : standard deviation of the weight
    truncated : whether the weight is limited to two standard deviations
    shared_name : name that both sides of the face have in common, such as "ears/ear-flap-"; targets with the
        same shared name get similar weights; "" for targets in the middle of the face
    """

    less: str
    more: str
    spread: float
    truncated: bool
    shared_name: str


@cache
def _opposite_targets() -> tuple[_OppositeTargets, ...]:
    """Return the pairs of opposite morph targets that are sampled, in the order of random draws."""
    known, pairs = human_targets(), list[_OppositeTargets]()
    for name in known:
        folder, local_name = name.split("/")
        if folder == "asym" and name.endswith("-l"):
            pairs.append(_OppositeTargets(f"{name[:-1]}r", name, _ASYMMETRY_SD, False, ""))
        if folder not in _WEIGHT_SD_BY_FOLDER or any(word in local_name for word in _EXCLUDED_TARGETS):
            continue
        sided = local_name[:2] in ("l-", "r-")
        for low, high in _OPPOSITE_SUFFIXES.items():
            stem = name.removesuffix(low)
            if stem != name and f"{stem}{high}" in known:
                shared_name = f"{folder}/{local_name[2:].removesuffix(low)}" if sided else ""
                deviation = _WEIGHT_SD_BY_FOLDER[folder]
                pairs.append(_OppositeTargets(name, f"{stem}{high}", deviation, True, shared_name))
    return tuple(pairs)
