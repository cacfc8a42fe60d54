"""Parametric people, with parameters set by the user or sampled at random."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import check_fields, checked_number
from dermis.base.renamed import renamed_classmethod
from dermis.human.hair.groom import add_hair
from dermis.human.hair.look import (
    HairLook,
    scalp_shadow_fields,
    stubble_visibility,
    typical_hair,
)
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE
from dermis.human.model import Layout, build_head, control_points_mm, head_template
from dermis.human.sampling import ANCESTRIES, sample_fields
from dermis.human.skin.look import (
    Demographics,
    SkinLook,
    typical_eyes,
    typical_skin,
)
from dermis.human.skin.measured import (
    ITA_RANGE,
    SKIN_ANCESTRIES,
    group_probabilities,
    group_weights,
)
from dermis.human.skin.painted import PaintedMaps
from dermis.human.wear.dress import Outfit, dress, dressed_template, worn_points_mm
from dermis.human.wear.look import ITEM_TYPES, Clothing, Glasses, Headwear, Item
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.subdivide import resolve_levels

_FIELD_RANGES = {
    "african": (0.0, 1.0),
    "asian": (0.0, 1.0),
    "caucasian": (0.0, 1.0),
    "sex": (0.0, 1.0),
    "age": (YOUNG_AGE, OLD_AGE),
    "weight": (-1.0, 1.0),
    "muscle": (-1.0, 1.0),
    "hair_eumelanin": (0.0, 10.0),
    "hair_pheomelanin": (0.0, 10.0),
}
_LOOK_TYPES = (("skin", SkinLook), ("eyes", EyeLook), ("hair", HairLook))
_MIN_FRACTION_OF_STRANDS = 0.05
_TARGET_WEIGHT_RANGE = -2.0, 2.0
_NO_TARGETS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Human:
    """Person described by parameters: ancestry, sex, age, weight, muscle, and MakeHuman's morph targets.

    Parameters
    ----------
    african, asian, caucasian : float
        Weights of the ancestries, 0 to 1; only their ratios count.
    sex : float
        Sex, from 0 (female) to 1 (male) [-].
    age : float
        Age, 25 to 90 [years].
    weight, muscle : float
        Body weight and muscle, from -1 (least) to 1 (most); 0 is average [-].
    hair_eumelanin, hair_pheomelanin : float
        Pigments of the hair if `hair` is not given, 0 to 10 [-]. Eumelanin of 0.3 gives blond hair, 1.3
        brown, 4 dark and 8 black hair; 0.3 with pheomelanin of 2 gives red hair.
    targets : mapping
        Weights of MakeHuman's morph targets, such as {"nose/nose-hump-incr": 0.5}, normally 0 to 1.
    skin, eyes, hair : SkinLook, EyeLook and HairLook, optional
        Looks of skin, eyes and hair; by default typical for the person.
    clothing, glasses, headwear : Clothing, Glasses and Headwear, optional
        What the person wears, or words such as "navy denim shirt"; by default none.
    skin_ancestry : str
        Name of a group of measured people, such as "south asian". The person gets the skin, eye and hair
        colours of this group, independently of the shape; "" for the colours of the shape's ancestries.
    ita : float, optional
        Individual typology angle of the cheek, -65 (darkest) to 70 (lightest) [degrees]; the pigments are
        typical of measured people whose skin has this angle. Ignored if `skin` is given.

    Raises
    ------
    DermisError
        For values out of range; names of targets are checked when the head is built.

    Examples
    --------
    >>> import dermis
    >>> person = dermis.Human(age=60, sex=1, targets={"nose/nose-hump-incr": 0.5})
    >>> person.positions_mm.shape[1], person.target_weights()["nose/nose-hump-incr"]
    (3, 0.5)
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
    skin_ancestry: str = ""
    ita: float | None = None
    clothing: Clothing | None = None
    glasses: Glasses | None = None
    headwear: Headwear | None = None

    def __post_init__(self) -> None:
        """Raise DermisError for fields out of range."""
        check_fields(self, _FIELD_RANGES)
        _check_skin_fields(self.skin_ancestry, self.ita)
        if not self.african + self.asian + self.caucasian > 0:
            refuse("ancestry", "a weight of african, asian or caucasian above 0", "all are 0", "Raise one")
        if not isinstance(self.targets, Mapping):
            expected, actual = "weights of targets by name", f"got {format_value(self.targets)}"
            refuse("targets", expected, actual, 'Write targets={"nose/nose-hump-incr": 0.5}')
        for name, weight in self.targets.items():
            if not isinstance(name, str):
                refuse("targets", "names", f"got {format_value(name)}", "See human_targets()")
            checked_number(f"target {name!r}", weight, *_TARGET_WEIGHT_RANGE, "beyond it is no face")
        for name, kind in _LOOK_TYPES:
            if not isinstance(look := getattr(self, name), kind | None):
                refuse(name, f"a {kind.__name__}", f"got {format_value(look)}", "Make one, or leave it out")
        for name, item in ITEM_TYPES.items():
            object.__setattr__(self, name, item.coerce(name, getattr(self, name)))

    @classmethod
    def sampled(cls, seed: int, **given: Any) -> Human:
        """Return a random plausible adult, mostly of one ancestry and slightly asymmetric.

        Parameters
        ----------
        seed : int
            0 to 2**32 - 1; the same seed gives the same person.
        **given
            Fields that are not sampled, such as `age=70`; for targets, skin, eyes and hair also some of the
            values, such as `skin={"melanin": 0.1}`; "sampled" for random worn items. Skin and hair fit
            age, sex and ancestry; with `ita` alone, the ancestry is that of measured people with this angle.

        Returns
        -------
        Human
            The sampled person.

        Raises
        ------
        DermisError
            For invalid seeds and for values out of range.

        Examples
        --------
        >>> import dermis
        >>> dermis.Human.sampled(7, age=70).age
        70.0
        """
        for name in given.keys() & _FIELD_RANGES.keys():
            checked_number(name, given[name], *_FIELD_RANGES[name])
        _check_skin_fields(given.get("skin_ancestry", ""), given.get("ita"))
        if given.get("ita") is not None and "melanin" in given.get("skin", {}):
            refuse("ita", "an ITA or the melanin of the skin", "both are given", "Remove one of them")
        return cls(**sample_fields(seed, given))

    def head(
        self,
        maps: Maps | None = None,
        layout: Layout = "own",
        subdivide: int | Callable[[Head], int] = 1,
        hairs: float = 1.0,
    ) -> Head:
        """Return the head in rest pose, with morph targets of expressions and bones.

        Parameters
        ----------
        maps : Maps, optional
            Maps of the skin; by default painted according to the look of the skin.
        layout : {"own", "hm08"}
            Uv layout: "own" gives the face most space; "hm08" is MakeHuman's layout, for MakeHuman's skins.
        subdivide : int or callable
            Levels of Catmull-Clark subdivision, 0 to 3, or a function that returns the levels for a head.
        hairs : float
            Fraction of scalp and beard hairs to create, 0.05 to 1; fewer hairs are wider, to keep coverage.

        Returns
        -------
        Head
            The head with eyes, hair and rig.

        Raises
        ------
        DermisError
            For values out of range, and if `targets` contains names that are not morph targets of MakeHuman.
        """
        if layout not in get_args(Layout):
            actual = f"got {format_value(layout)}"
            refuse("layout", f"one of {', '.join(get_args(Layout))}", actual, "Choose one")
        checked_number("hairs", hairs, _MIN_FRACTION_OF_STRANDS, 1.0)
        painted = maps or PaintedMaps(look=self.look)
        control_head = build_head(self.target_weights(), painted, layout, self.iris)
        shared = head_template(layout, resolve_levels(control_head, subdivide))
        head = shared.refine_head(control_head)
        head = add_hair(head, control_head, shared.root_finder, self.hair_look, self.look.recession, hairs)
        if not outfit(self):
            return head
        return dress(head, outfit(self), dressed_template(layout, head.levels, outfit(self)))

    def transfer_skin_to(self, head: Head) -> Head:
        """Return the head of another person with the skin and eyes of this person.

        A pose `Pose(positions_mm=person.positions_mm)` gives the head the shape of this person too, faster
        than building a new head. Hair and joints remain unchanged.

        Parameters
        ----------
        head : Head
            Head of the parametric human with painted skin.

        Returns
        -------
        Head
            The head with the skin maps and the eye look of this person.

        Raises
        ------
        DermisError
            For heads that are not parametric or whose skin is not painted.
        """
        if not isinstance(head.maps, PaintedMaps) or head.eyes is None:
            refuse(
                head.name,
                "a head of the parametric human with painted skin",
                "it is another head",
                "Load human",
            )
        eyes = head.eyes.with_look(self.iris)
        return replace(head, maps=replace(head.maps, look=self.look), eyes=eyes)

    @property
    def look(self) -> SkinLook:
        """Return the field `skin`, or the typical skin look for the person's ancestry, sex and age."""
        if self.skin is not None:
            return self.skin
        typical, visibility = typical_skin(self._demographics), stubble_visibility(self.hair_look)
        shadow = scalp_shadow_fields(self.hair_look, typical.stubble)
        return replace(typical, **shadow, beard=visibility * typical.beard)

    @property
    def iris(self) -> EyeLook:
        """Return the field `eyes`, or the typical eye look for the person's ancestry."""
        return typical_eyes(self._demographics) if self.eyes is None else self.eyes

    @property
    def hair_look(self) -> HairLook:
        """Return the field `hair`, or the typical hair look for the person's ancestry, sex and age."""
        if self.hair is not None:
            return self.hair
        return typical_hair(self._demographics, self.hair_eumelanin, self.hair_pheomelanin)

    @property
    def _demographics(self) -> Demographics:
        total = self.african + self.asian + self.caucasian
        fractions = self.african / total, self.asian / total, self.caucasian / total
        groups = group_weights(*fractions, self.skin_ancestry)
        if self.ita is not None and not self.skin_ancestry and len(set(fractions)) == 1:
            groups = group_probabilities(self.ita)  # no ancestry is given
        return Demographics(*fractions, self.sex, self.age, groups, self.ita)

    @property
    def positions_mm(self) -> NDArray[np.float32]:
        """Return the control points (p, 3) in rest pose, relative to the midpoint between the eyes [mm].

        `Pose(positions_mm=...)` gives any head that wears the same this shape: all have the same points.
        Raises DermisError if `targets` contains names that are not morph targets of MakeHuman.
        """
        points = control_points_mm(self.target_weights())
        if not outfit(self):
            return points
        return np.concatenate([points, worn_points_mm(points, outfit(self))])

    def target_weights(self) -> dict[str, float]:
        """Return the nonzero weights of MakeHuman's morph targets for this person, by target name."""
        weights = {**self._ancestry_weights(), **self._physique_weights()}
        for name, weight in self.targets.items():
            weights[name] = weights.get(name, 0.0) + weight
        return {name: weight for name, weight in weights.items() if weight}

    def _ancestry_weights(self) -> dict[str, float]:
        total = self.african + self.asian + self.caucasian
        return {
            f"macrodetails/{people}-{kind}": getattr(self, people) / total * fraction
            for people in ANCESTRIES
            for kind, fraction in self._adult_fractions().items()
        }

    def _physique_weights(self) -> dict[str, float]:
        """Return the weights of morph targets for body weight and muscle; average build needs no targets."""
        weights = {}
        for kind, fraction in self._adult_fractions().items():
            for muscle, muscle_fraction in _blend_fractions(self.muscle).items():
                for weight, weight_fraction in _blend_fractions(self.weight).items():
                    if (muscle, weight) != ("average", "average"):
                        name = f"macrodetails/universal-{kind}-{muscle}muscle-{weight}weight"
                        weights[name] = fraction * muscle_fraction * weight_fraction
        return weights

    def _adult_fractions(self) -> dict[str, float]:
        """Return the blend fractions of MakeHuman's four adults: female or male, young or old."""
        old = (self.age - YOUNG_AGE) / (OLD_AGE - YOUNG_AGE)
        return {
            f"{sex}-{age}": sex_fraction * age_fraction
            for sex, sex_fraction in (("female", 1.0 - self.sex), ("male", self.sex))
            for age, age_fraction in (("young", 1.0 - old), ("old", old))
        }

    drawn = renamed_classmethod("drawn", "sampled")


def outfit(person: Human) -> Outfit:
    """Return the items that a person wears."""
    return tuple(item for item in worn_items(person).values() if item is not None)


def worn_items(person: Human) -> dict[str, Item | None]:
    """Return what a person wears by field of `Human`, such as "glasses"; None for a field without an item."""
    return {name: getattr(person, name) for name in ITEM_TYPES}


def _check_skin_fields(skin_ancestry: object, ita: object) -> None:
    if skin_ancestry != "" and skin_ancestry not in SKIN_ANCESTRIES:
        expected, actual = f"one of {', '.join(SKIN_ANCESTRIES)}", f"got {format_value(skin_ancestry)}"
        refuse("skin_ancestry", expected, actual, "Choose one, or leave it out")
    if ita is not None:
        checked_number("ita", ita, *ITA_RANGE, "degrees")


def _blend_fractions(body_parameter: float) -> dict[str, float]:
    """Return linear blend fractions of "min", "average" and "max" for a parameter from -1 to 1."""
    return {
        "min": max(-body_parameter, 0.0),
        "average": 1.0 - abs(body_parameter),
        "max": max(body_parameter, 0.0),
    }
