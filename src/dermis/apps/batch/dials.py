"""Names and bounds of what other models hold: looks of people, dials of the skin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from dermis.apps.batch.distributions import Distribution
from dermis.base.errors import DermisError, refuse
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.human.skin.look import SkinLook
from dermis.mesh.eyes import EyeLook
from dermis.scene.pose import MOST_WEIGHT
from dermis.scene.skin import Skin

_NO_DIALS = "pigments", "layers", "profile_map", "other_profiles"
_SEED = "seed"  # a whole number, which follows from the person
_LOOKS: Mapping[str, type] = {"skin": SkinLook, "eyes": EyeLook, "hair": HairLook}


def check_looks(person: Any) -> None:
    """Refuse names and values that a person's skin, eyes, hair and targets do not have."""
    for part, kind in _LOOKS.items():
        known = [one.name for one in fields(kind) if one.name != _SEED]
        _check(f"person.{part}", getattr(person, part), known, lambda values, kind=kind: kind(**values))
    known = list(_published())
    _check("person.targets", person.targets, known, lambda values: Human(targets=values))


def check_skin(dials: Mapping[str, Distribution]) -> None:
    """Refuse names and values that `Skin` does not have."""
    known = [name for name in Skin.model_fields if name not in _NO_DIALS]
    _check("skin", dials, known, lambda values: Skin(**values))


def check_weights(weights: Mapping[str, Distribution]) -> None:
    """Refuse weights of targets that no pose takes."""
    for name, drawn in weights.items():
        if any(isinstance(end, str) or abs(end) > MOST_WEIGHT for end in drawn.ends):
            expected = f"numbers from {-MOST_WEIGHT:g} to {MOST_WEIGHT:g}"
            refuse(f"pose: {name}", expected, f"{drawn.told()} came", "Correct it")


def _published() -> tuple[str, ...]:
    from dermis.human.published import human_targets

    return human_targets()


def _check(table: str, drawn: Mapping[str, Distribution], known: list[str], make: Any) -> None:
    """Try the ends of each."""
    for name, one in drawn.items():
        if name not in known:
            listed = ", ".join(known) if len(known) < 40 else "those of dermis head --list-targets"
            refuse(f"{table}: {name}", f"one of {listed}", "this name is unknown", "Correct it")
        for end in one.ends:
            try:
                make({name: end})
            except DermisError as error:
                raise DermisError(f"{table}: {error}") from None
