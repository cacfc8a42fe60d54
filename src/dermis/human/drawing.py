"""People at random: macro weights that go together, and small differences of every part of the face."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.quantities import whole_number
from dermis.human.hair.look import HairLook
from dermis.human.hair.usual import drawn_hair, shaved_shows, usual_hair, usual_recession
from dermis.human.published import OLD, YOUNG, human_targets
from dermis.human.skin.look import SkinLook
from dermis.human.skin.usual import Origin, drawn_eyes, drawn_look

_MOST_SEED = 2**32 - 1
_BEARDED = 0.6  # shadow of shaved hair below a beard
_ALIKE = 0.35  # of the Dirichlet distribution of ancestries: most people have mostly one
_BETWEEN = 0.08  # standard deviation of the sex from its ends
_WAYS = (("decr", "incr"), ("down", "up"), ("in", "out"), ("backward", "forward"), ("concave", "convex"))
"""Ends of the names of two targets that are each other's opposite."""
_SPREAD = {  # standard deviation of the weights of a folder's targets
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
_LEFT_OUT = ("trans", "age", "fat", "measure", "push")  # what macro weights say, and what moves a whole part
_SIDES = 0.2  # of the spread, by which left and right differ
_ASYMMETRY = 0.1
_SHAPES = ("diamond", "invertedtriangular", "oval", "rectangular", "round", "square", "triangular")
_MOST_SHAPE = 0.3
_ANCESTRY = "african", "asian", "caucasian"
_LOOKS = "targets", "skin", "eyes", "hair"


def drawn(seed: int, given: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of `Human`, see `Human.drawn`."""
    macro = {name: float(value) for name, value in given.items() if name not in _LOOKS}
    rng = np.random.default_rng(whole_number("seed", seed, 0, _MOST_SEED))
    shares = _ancestry(macro, rng.dirichlet((_ALIKE,) * 3))
    sex = min(abs(rng.normal(0.0, _BETWEEN)), 0.3)
    sex = macro.get("sex", 1.0 - sex if rng.random() < 0.5 else sex)
    share = rng.beta(1.2, 2.2)
    share = (macro["age"] - YOUNG) / (OLD - YOUNG) if "age" in macro else share
    weight = rng.normal(0.3 * share - 0.1, 0.25)
    muscle = rng.normal(0.2 * sex - 0.1 - 0.3 * share, 0.2)
    found: dict[str, Any] = {
        "sex": float(sex),
        "age": float(YOUNG + (OLD - YOUNG) * share),
        "weight": float(np.clip(weight, -0.7, 0.8)),
        "muscle": float(np.clip(muscle, -0.6, 0.6)),
        "targets": {**dict(_details(rng)), **given.get("targets", {})},
    }
    found |= dict(zip(_ANCESTRY, map(float, shares), strict=True)) | macro
    african, asian, caucasian = shares
    origin = Origin(african, asian, caucasian, found["sex"], found["age"])
    skin, eyes = drawn_look(rng, origin), drawn_eyes(rng, origin)
    brown, red = _hair(np.random.default_rng((int(seed), 1)), shares)
    colour = {"hair_eumelanin": brown, "hair_pheomelanin": red} | macro
    found |= colour | {"eyes": replace(eyes, **given.get("eyes", {}))}
    usual = usual_hair(origin, colour["hair_eumelanin"], colour["hair_pheomelanin"])
    return found | _hairdo(np.random.default_rng((int(seed), 2)), origin, usual, skin, given)


def _ancestry(given: Mapping[str, float], own: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) shares of the ancestries that are given, which need not add up to 1; else the person's own."""
    if not any(name in given for name in _ANCESTRY):
        return own
    shares = np.array([given.get(name, 0.0) for name in _ANCESTRY])
    if not shares.sum() > 0:
        refuse("ancestry", "a share of african, asian or caucasian", "all that are given are 0", "Raise one")
    return np.asarray(shares / shares.sum())


def _hairdo(
    rng: np.random.Generator, origin: Origin, usual: HairLook, skin: SkinLook, given: Mapping[str, Any]
) -> dict[str, Any]:
    """Hair, and the skin with what shows of it there."""
    hair, recession = drawn_hair(rng, origin, usual), usual_recession(rng, origin)
    hair = replace(hair, **given.get("hair", {}))
    shown = shaved_shows(hair)
    beard = shown * max(skin.beard, _BEARDED if hair.beard_mm else 0.0)
    seen = replace(skin, stubble=shown * skin.stubble, beard=beard, recession=recession)
    return {"hair": hair, "skin": replace(seen, **given.get("skin", {}))}


def _hair(rng: np.random.Generator, shares: NDArray[np.float64]) -> tuple[float, float]:
    """Eumelanin and pheomelanin of the hair: near to black but for people of mostly European descent.

    shares : (3,) of the ancestries
    """
    fair = np.exp(rng.uniform(np.log(0.4), np.log(5.0)))
    brown = float(np.exp(shares @ np.log([8.0, 7.0, fair])) * rng.lognormal(0.0, 0.1))
    red = float(shares[2] * rng.exponential(0.35) + 0.1)
    return min(brown, 10.0), min(red, 4.0)


def _details(rng: np.random.Generator) -> Iterator[tuple[str, float]]:
    """Weights of targets, always drawn in the same order."""
    common: dict[str, float] = {}
    chance = iter(rng.standard_normal(sum(1 + bool(one.shared) for one in _differences())).tolist())
    for one in _differences():
        value = one.spread * next(chance)
        if one.limited:
            value = min(max(value, -2 * one.spread), 2 * one.spread)
        if one.shared:  # left and right are nearly alike
            value = common.setdefault(one.shared, value) + _SIDES * one.spread * next(chance)
        yield (one.more if value > 0 else one.less), abs(value)
    yield f"head/head-{rng.choice(_SHAPES)}", float(rng.uniform(0.0, _MOST_SHAPE))


class _Difference(NamedTuple):
    """What people differ by: two targets that are each other's opposite.

    less, more : their names
    spread : standard deviation of the weight
    limited : whether it lies within two of these
    shared : what the other side of the face has too, or ""
    """

    less: str
    more: str
    spread: float
    limited: bool
    shared: str


@cache
def _differences() -> tuple[_Difference, ...]:
    """All that details are drawn for, in their order."""
    known, found = human_targets(), list[_Difference]()
    for name in known:
        folder, rest = name.split("/")
        if folder == "asym" and name.endswith("-l"):
            found.append(_Difference(f"{name[:-1]}r", name, _ASYMMETRY, False, ""))
        if folder not in _SPREAD or any(word in rest for word in _LEFT_OUT):
            continue
        sided = rest[:2] in ("l-", "r-")
        for low, high in _WAYS:
            stem = name.removesuffix(low)
            if stem != name and f"{stem}{high}" in known:
                shared = f"{folder}/{rest[2:].removesuffix(low)}" if sided else ""
                found.append(_Difference(name, f"{stem}{high}", _SPREAD[folder], True, shared))
    return tuple(found)
