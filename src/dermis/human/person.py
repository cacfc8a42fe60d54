"""People of the parametric human: what makes one differ from another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse, shown_value
from dermis.base.quantities import check_numbers, number
from dermis.human.drawing import drawn
from dermis.human.hair.groom import groomed
from dermis.human.hair.look import HairLook
from dermis.human.hair.usual import shaved_shows, usual_hair
from dermis.human.model import Layout, control_mm, human_head
from dermis.human.published import OLD, YOUNG
from dermis.human.skin.look import SkinLook
from dermis.human.skin.painted import PaintedMaps
from dermis.human.skin.usual import Origin, usual_eyes, usual_look
from dermis.human.template import template
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.subdivide import levels_of

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
_LEAST_HAIRS = 0.05
_MOST_WEIGHT = 2.0  # of a published target
_NONE: Mapping[str, float] = MappingProxyType({})
Levels = int | Callable[[Head], int]


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
    targets: Mapping[str, float] = field(default_factory=lambda: _NONE)
    skin: SkinLook | None = None
    eyes: EyeLook | None = None
    hair: HairLook | None = None

    def __post_init__(self) -> None:
        check_numbers(self, _RANGES)
        if not self.african + self.asian + self.caucasian > 0:
            refuse("ancestry", "a share of african, asian or caucasian", "all are 0", "Raise one")
        if not isinstance(self.targets, Mapping):
            expected, came = "weights of targets by name", f"{shown_value(self.targets)} came"
            refuse("targets", expected, came, 'Write targets={"nose/nose-hump-incr": 0.5}')
        for name, weight in self.targets.items():
            if not isinstance(name, str):
                refuse("targets", "names", f"{shown_value(name)} came", "See human_targets()")
            number(f"target {name!r}", weight, -_MOST_WEIGHT, _MOST_WEIGHT, "what lies beyond is no face")
        for name, kind in (("skin", SkinLook), ("eyes", EyeLook), ("hair", HairLook)):
            if not isinstance(look := getattr(self, name), kind | None):
                refuse(name, f"a {kind.__name__}", f"{shown_value(look)} came", "Make one, or leave it out")

    @classmethod
    def drawn(cls, seed: int, **given: Any) -> Human:
        """A plausible adult, the same for the same seed: mostly of one ancestry, a little asymmetric.

        seed : 0 to 2**32 - 1
        given : fields that are not drawn, such as `age=70`; some of targets, skin, eyes and hair by name, as
            `skin={"melanin": 0.1}`. Skin and hair go with the age, the sex and the ancestry that are given

        Raises DermisError for other seeds and for values out of range.
        """
        for name in given.keys() & _RANGES.keys():
            number(name, given[name], *_RANGES[name])
        return cls(**drawn(seed, given))

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
            came = f"{shown_value(layout)} came"
            refuse("layout", f"one of {', '.join(get_args(Layout))}", came, "Choose one")
        number("hairs", hairs, _LEAST_HAIRS, 1.0)
        painted = maps or PaintedMaps(look=self.look)
        plain = human_head(self.weights(), painted, layout, self.iris)
        shared = template(layout, levels_of(plain, subdivide))
        head = shared.shaped(plain)
        return groomed(head, plain, shared.rooting, self.hairdo, self.look.recession, hairs)

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
        usual, shown = usual_look(self._origin), shaved_shows(self.hairdo)
        return replace(usual, stubble=shown * usual.stubble, beard=shown * usual.beard)

    @property
    def iris(self) -> EyeLook:
        """The person's eyes: its own, or what usually goes with such a person."""
        return usual_eyes(self._origin) if self.eyes is None else self.eyes

    @property
    def hairdo(self) -> HairLook:
        """The person's hair: its own, or what usually goes with such a person."""
        if self.hair is not None:
            return self.hair
        return usual_hair(self._origin, self.hair_eumelanin, self.hair_pheomelanin)

    @property
    def _origin(self) -> Origin:
        total = self.african + self.asian + self.caucasian
        shares = self.african / total, self.asian / total, self.caucasian / total
        return Origin(*shares, self.sex, self.age)

    @property
    def positions_mm(self) -> NDArray[np.float32]:
        """(p, 3) where the person's control points rest, from the middle between the eyes [mm].

        Any head of the parametric human, which all have these points, is this person by
        `Pose(positions_mm=...)`.

        Raises DermisError for targets that nobody knows.
        """
        return control_mm(self.weights())

    def weights(self) -> dict[str, float]:
        """Weights of published targets by name, those of 0 left out."""
        found = {**self._ancestry(), **self._build()}
        for name, weight in self.targets.items():
            if not isinstance(name, str):
                refuse("targets", "names", f"{shown_value(name)} came", "See human_targets()")
            found[name] = found.get(name, 0.0) + weight
        return {name: weight for name, weight in found.items() if weight}

    def _ancestry(self) -> dict[str, float]:
        total = self.african + self.asian + self.caucasian
        return {
            f"macrodetails/{people}-{kind}": getattr(self, people) / total * share
            for people in ("african", "asian", "caucasian")
            for kind, share in self._kinds().items()
        }

    def _build(self) -> dict[str, float]:
        """Of weight and muscle; the average of both needs no target."""
        found = {}
        for kind, share in self._kinds().items():
            for muscle, much in _steps(self.muscle).items():
                for weight, more in _steps(self.weight).items():
                    if (muscle, weight) != ("average", "average"):
                        name = f"macrodetails/universal-{kind}-{muscle}muscle-{weight}weight"
                        found[name] = share * much * more
        return found

    def _kinds(self) -> dict[str, float]:
        """Shares of the four published kinds of adults."""
        old = (self.age - YOUNG) / (OLD - YOUNG)
        return {
            f"{sex}-{age}": share * part
            for sex, share in (("female", 1.0 - self.sex), ("male", self.sex))
            for age, part in (("young", 1.0 - old), ("old", old))
        }


def _steps(value: float) -> dict[str, float]:
    """Shares of the least, the average and the most, for a value from -1 to 1."""
    return {"min": max(-value, 0.0), "average": 1.0 - abs(value), "max": max(value, 0.0)}
