"""People of the parametric human, given by numbers or drawn at random."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import check_fields, checked_integer, checked_number
from dermis.human.hair.groom import add_hair
from dermis.human.hair.look import HairLook, sample_hair, sample_recession, stubble_visibility, typical_hair
from dermis.human.makehuman import OLD, YOUNG, human_targets
from dermis.human.model import Layout, build_head, control_points_mm, template
from dermis.human.skin.look import (
    Demographics,
    SkinLook,
    sample_eyes,
    sample_skin,
    typical_eyes,
    typical_skin,
)
from dermis.human.skin.painted import PaintedMaps
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.subdivide import levels_of

_MAX_SEED = 2**32 - 1
_MIN_BEARD_SHADOW = 0.6  # shadow of shaved hair below a beard
_ANCESTRY_CONCENTRATION = 0.35  # of the Dirichlet distribution of ancestries: most people have mostly one
_SEX_DEVIATION = 0.08  # standard deviation of the sex from its ends
_OPPOSITE_SUFFIXES = (
    ("decr", "incr"),
    ("down", "up"),
    ("in", "out"),
    ("backward", "forward"),
    ("concave", "convex"),
)
"""Ends of the names of two targets that are each other's opposite."""
_FOLDER_DEVIATIONS = {  # standard deviation of the weights of a folder's targets
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
_EXCLUDED = ("trans", "age", "fat", "measure", "push")  # what macro weights say, and what moves a whole part
_SIDE_DEVIATION = 0.2  # of the spread, by which left and right differ
_ASYMMETRY_DEVIATION = 0.1
_SHAPES = ("diamond", "invertedtriangular", "oval", "rectangular", "round", "square", "triangular")
_MAX_SHAPE_WEIGHT = 0.3
_ANCESTRY = "african", "asian", "caucasian"
_LOOK_FIELDS = "targets", "skin", "eyes", "hair"
_RANGES = {
    "african": (0.0, 1.0),
    "asian": (0.0, 1.0),
    "caucasian": (0.0, 1.0),
    "sex": (0.0, 1.0),
    "age": (YOUNG, OLD),
    "weight": (-1.0, 1.0),
    "muscle": (-1.0, 1.0),
    "hair_eumelanin": (0.0, 10.0),
    "hair_pheomelanin": (0.0, 10.0),
}
_MIN_HAIR_FRACTION = 0.05
_MAX_TARGET_WEIGHT = 2.0  # of a published target
_NO_TARGETS: Mapping[str, float] = MappingProxyType({})
Levels = int | Callable[[Head], int]


def sample_fields(seed: int, given: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of `Human`, see `Human.drawn`."""
    macro = {name: float(value) for name, value in given.items() if name not in _LOOK_FIELDS}
    rng = np.random.default_rng(checked_integer("seed", seed, 0, _MAX_SEED))
    shares = _ancestry(macro, rng.dirichlet((_ANCESTRY_CONCENTRATION,) * 3))
    sex = min(abs(rng.normal(0.0, _SEX_DEVIATION)), 0.3)
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
        "targets": {**dict(_sample_targets(rng)), **given.get("targets", {})},
    }
    found |= dict(zip(_ANCESTRY, map(float, shares), strict=True)) | macro
    african, asian, caucasian = shares
    demographics = Demographics(african, asian, caucasian, found["sex"], found["age"])
    skin, eyes = sample_skin(rng, demographics), sample_eyes(rng, demographics)
    brown, red = _sample_hair_pigments(np.random.default_rng((int(seed), 1)), shares)
    colour = {"hair_eumelanin": brown, "hair_pheomelanin": red} | macro
    found |= colour | {"eyes": replace(eyes, **given.get("eyes", {}))}
    usual = typical_hair(demographics, colour["hair_eumelanin"], colour["hair_pheomelanin"])
    return found | _sample_hair_and_skin(
        np.random.default_rng((int(seed), 2)), demographics, usual, skin, given
    )


def _ancestry(given: Mapping[str, float], own: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) shares of the ancestries that are given, which need not add up to 1; else the person's own."""
    if not any(name in given for name in _ANCESTRY):
        return own
    shares = np.array([given.get(name, 0.0) for name in _ANCESTRY])
    if not shares.sum() > 0:
        refuse("ancestry", "a share of african, asian or caucasian", "all that are given are 0", "Raise one")
    return np.asarray(shares / shares.sum())


def _sample_hair_and_skin(
    rng: np.random.Generator,
    demographics: Demographics,
    usual: HairLook,
    skin: SkinLook,
    given: Mapping[str, Any],
) -> dict[str, Any]:
    """Hair, and the skin with what shows of it there."""
    hair, recession = sample_hair(rng, demographics, usual), sample_recession(rng, demographics)
    hair = replace(hair, **given.get("hair", {}))
    shown = stubble_visibility(hair)
    beard = shown * max(skin.beard, _MIN_BEARD_SHADOW if hair.beard_mm else 0.0)
    seen = replace(skin, stubble=shown * skin.stubble, beard=beard, recession=recession)
    return {"hair": hair, "skin": replace(seen, **given.get("skin", {}))}


def _sample_hair_pigments(rng: np.random.Generator, shares: NDArray[np.float64]) -> tuple[float, float]:
    """Eumelanin and pheomelanin of the hair: near to black but for people of mostly European descent.

    shares : (3,) of the ancestries
    """
    fair = np.exp(rng.uniform(np.log(0.4), np.log(5.0)))
    brown = float(np.exp(shares @ np.log([8.0, 7.0, fair])) * rng.lognormal(0.0, 0.1))
    red = float(shares[2] * rng.exponential(0.35) + 0.1)
    return min(brown, 10.0), min(red, 4.0)


def _sample_targets(rng: np.random.Generator) -> Iterator[tuple[str, float]]:
    """Weights of targets, always drawn in the same order."""
    common: dict[str, float] = {}
    chance = iter(rng.standard_normal(sum(1 + bool(one.mirrored) for one in _opposite_targets())).tolist())
    for one in _opposite_targets():
        value = one.spread * next(chance)
        if one.truncated:
            value = min(max(value, -2 * one.spread), 2 * one.spread)
        if one.mirrored:  # left and right are nearly alike
            value = common.setdefault(one.mirrored, value) + _SIDE_DEVIATION * one.spread * next(chance)
        yield (one.more if value > 0 else one.less), abs(value)
    yield f"head/head-{rng.choice(_SHAPES)}", float(rng.uniform(0.0, _MAX_SHAPE_WEIGHT))


class _OppositeTargets(NamedTuple):
    """What people differ by: two targets that are each other's opposite.

    less, more : their names
    spread : standard deviation of the weight
    limited : whether it lies within two of these
    shared : what the other side of the face has too, or ""
    """

    less: str
    more: str
    spread: float
    truncated: bool
    mirrored: str


@cache
def _opposite_targets() -> tuple[_OppositeTargets, ...]:
    """All that details are drawn for, in their order."""
    known, found = human_targets(), list[_OppositeTargets]()
    for name in known:
        folder, rest = name.split("/")
        if folder == "asym" and name.endswith("-l"):
            found.append(_OppositeTargets(f"{name[:-1]}r", name, _ASYMMETRY_DEVIATION, False, ""))
        if folder not in _FOLDER_DEVIATIONS or any(word in rest for word in _EXCLUDED):
            continue
        sided = rest[:2] in ("l-", "r-")
        for low, high in _OPPOSITE_SUFFIXES:
            stem = name.removesuffix(low)
            if stem != name and f"{stem}{high}" in known:
                mirrored = f"{folder}/{rest[2:].removesuffix(low)}" if sided else ""
                found.append(
                    _OppositeTargets(name, f"{stem}{high}", _FOLDER_DEVIATIONS[folder], True, mirrored)
                )
    return tuple(found)


@dataclass(frozen=True)
class Human:
    """A person: macro targets by ancestry, sex, age, weight and muscle, and any published target by name.

    african, asian, caucasian : shares of the ancestries, 0 to 1; their ratios count
    sex : from 0, female, to 1, male [-]
    age : 25 to 90 [years]
    weight, muscle : from -1, least, to 1, most; 0 is the average [-]
    hair_eumelanin, hair_pheomelanin : of hair as it usually is: 0.3 of the first is blond, 1.3 brown,
        4 dark, 8 black; red has 0.3 and 2
    targets : weights of published targets, such as {"nose/nose-hump-incr": 0.5}; mostly 0 to 1
    skin, eyes, hair : what they look like; what usually goes with the person when left out

    Raises DermisError for values out of range; names of targets are checked when the head is made.
    """

    african: float = 1 / 3
    asian: float = 1 / 3
    caucasian: float = 1 / 3
    sex: float = 0.0
    age: float = 30.0
    weight: float = 0.0
    muscle: float = 0.0
    hair_eumelanin: float = 4.0
    hair_pheomelanin: float = 0.3
    targets: Mapping[str, float] = field(default_factory=lambda: _NO_TARGETS)
    skin: SkinLook | None = None
    eyes: EyeLook | None = None
    hair: HairLook | None = None

    def __post_init__(self) -> None:
        check_fields(self, _RANGES)
        if not self.african + self.asian + self.caucasian > 0:
            refuse("ancestry", "a share of african, asian or caucasian", "all are 0", "Raise one")
        if not isinstance(self.targets, Mapping):
            expected, actual = "weights of targets by name", f"got {format_value(self.targets)}"
            refuse("targets", expected, actual, 'Write targets={"nose/nose-hump-incr": 0.5}')
        for name, weight in self.targets.items():
            if not isinstance(name, str):
                refuse("targets", "names", f"got {format_value(name)}", "See human_targets()")
            checked_number(
                f"target {name!r}",
                weight,
                -_MAX_TARGET_WEIGHT,
                _MAX_TARGET_WEIGHT,
                "what lies beyond is no face",
            )
        for name, kind in (("skin", SkinLook), ("eyes", EyeLook), ("hair", HairLook)):
            if not isinstance(look := getattr(self, name), kind | None):
                refuse(name, f"a {kind.__name__}", f"got {format_value(look)}", "Make one, or leave it out")

    @classmethod
    def drawn(cls, seed: int, **given: Any) -> Human:
        """A plausible adult, the same for the same seed: mostly of one ancestry, a little asymmetric.

        seed : 0 to 2**32 - 1
        given : fields that are not drawn, such as `age=70`; some of targets, skin, eyes and hair by name, as
            `skin={"melanin": 0.1}`. Skin and hair go with the age, the sex and the ancestry that are given

        Raises DermisError for other seeds and for values out of range.
        """
        for name in given.keys() & _RANGES.keys():
            checked_number(name, given[name], *_RANGES[name])
        return cls(**sample_fields(seed, given))

    def head(
        self, maps: Maps | None = None, layout: Layout = "own", subdivide: Levels = 1, hairs: float = 1.0
    ) -> Head:
        """The person at rest, with expressions and bones to move by.

        maps : those of the skin; painted as `look` says when left out
        layout : "own" has most room for the face; "hm08" is the published one, which MakeHuman's skins fit
        subdivide : levels of Catmull and Clark's subdivision, 0 to 3, or what finds them for the head
        hairs : share of the usual number on head and chin that grows, each as much wider; 0.05 to 1

        Raises DermisError for targets that nobody knows, and for other shares.
        """
        if layout not in get_args(Layout):
            actual = f"got {format_value(layout)}"
            refuse("layout", f"one of {', '.join(get_args(Layout))}", actual, "Choose one")
        checked_number("hairs", hairs, _MIN_HAIR_FRACTION, 1.0)
        painted = maps or PaintedMaps(look=self.look)
        plain = build_head(self.weights(), painted, layout, self.iris)
        shared_template = template(layout, levels_of(plain, subdivide))
        head = shared_template.refine_head(plain)
        return add_hair(head, plain, shared_template.rooting, self.hairdo, self.look.recession, hairs)

    def on(self, head: Head) -> Head:
        """The head of another person with this one's skin and eyes.

        With `Pose(positions_mm=person.positions_mm)` it has this person's shape too, and only the skin is
        painted anew. Places where bones turn stay the other's, and so does the hair.

        Raises DermisError for heads that are no painted people.
        """
        if not isinstance(head.maps, PaintedMaps) or head.eyes is None:
            refuse(head.name, "a head of the parametric human with painted skin", "it is none", "Load human")
        eyes = head.eyes.with_look(self.iris)
        return replace(head, maps=replace(head.maps, look=self.look), eyes=eyes)

    @property
    def look(self) -> SkinLook:
        """The person's skin: its own, or what usually goes with such a person."""
        if self.skin is not None:
            return self.skin
        usual, shown = typical_skin(self._demographics), stubble_visibility(self.hairdo)
        return replace(usual, stubble=shown * usual.stubble, beard=shown * usual.beard)

    @property
    def iris(self) -> EyeLook:
        """The person's eyes: its own, or what usually goes with such a person."""
        return typical_eyes(self._demographics) if self.eyes is None else self.eyes

    @property
    def hairdo(self) -> HairLook:
        """The person's hair: its own, or what usually goes with such a person."""
        if self.hair is not None:
            return self.hair
        return typical_hair(self._demographics, self.hair_eumelanin, self.hair_pheomelanin)

    @property
    def _demographics(self) -> Demographics:
        total = self.african + self.asian + self.caucasian
        shares = self.african / total, self.asian / total, self.caucasian / total
        return Demographics(*shares, self.sex, self.age)

    @property
    def positions_mm(self) -> NDArray[np.float32]:
        """(p, 3) where the person's control points rest, from the middle between the eyes [mm].

        Any head of the parametric human, which all have these points, is this person by
        `Pose(positions_mm=...)`.

        Raises DermisError for targets that nobody knows.
        """
        return control_points_mm(self.weights())

    def weights(self) -> dict[str, float]:
        """Weights of published targets by name, those of 0 left out."""
        found = {**self._ancestry(), **self._build()}
        for name, weight in self.targets.items():
            if not isinstance(name, str):
                refuse("targets", "names", f"got {format_value(name)}", "See human_targets()")
            found[name] = found.get(name, 0.0) + weight
        return {name: weight for name, weight in found.items() if weight}

    def _ancestry(self) -> dict[str, float]:
        total = self.african + self.asian + self.caucasian
        return {
            f"macrodetails/{people}-{kind}": getattr(self, people) / total * share
            for people in ("african", "asian", "caucasian")
            for kind, share in self._adult_fractions().items()
        }

    def _build(self) -> dict[str, float]:
        """Of weight and muscle; the average of both needs no target."""
        found = {}
        for kind, share in self._adult_fractions().items():
            for muscle, much in _blend_steps(self.muscle).items():
                for weight, more in _blend_steps(self.weight).items():
                    if (muscle, weight) != ("average", "average"):
                        name = f"macrodetails/universal-{kind}-{muscle}muscle-{weight}weight"
                        found[name] = share * much * more
        return found

    def _adult_fractions(self) -> dict[str, float]:
        """Shares of the four published kinds of adults."""
        old = (self.age - YOUNG) / (OLD - YOUNG)
        return {
            f"{sex}-{age}": share * part
            for sex, share in (("female", 1.0 - self.sex), ("male", self.sex))
            for age, part in (("young", 1.0 - old), ("old", old))
        }


def _blend_steps(value: float) -> dict[str, float]:
    """Shares of the least, the average and the most, for a value from -1 to 1."""
    return {"min": max(-value, 0.0), "average": 1.0 - abs(value), "max": max(value, 0.0)}
