"""Registry of named expressions: weights of the human's morph targets."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources

from dermis.base.registry import Registry
from dermis.human.makehuman import EXPRESSION_PREFIX, target_deltas

Weights = Mapping[str, float]
TARGET_SIDES = "Left", "Right"
EXPRESSIONS: Registry[Weights] = Registry(
    "expression", tomllib.loads(resources.files(__package__).joinpath("expressions.toml").read_text("utf-8"))
)
"""Morph target weights of each named expression, from expressions.toml; other packages may register more."""


def expression(name: str) -> dict[str, float]:
    """Return the morph target weights of a named expression as a mapping that `dermis.Pose` accepts.

    Raises DermisError for an unknown name.
    """
    return {target: weight for one, weight in EXPRESSIONS[name].items() for target in expand_sides(one)}


def available_expressions(target_names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the expressions whose morph targets are all among given names."""
    known = {*target_names}
    return tuple(name for name in EXPRESSIONS if expression(name).keys() <= known)


def expand_targets(names: Iterable[str]) -> tuple[str, ...]:
    """Return morph target names without duplicates; names without a side become the names for both sides.

    For example, "mouthSmile" is replaced by "mouthSmileLeft" and "mouthSmileRight".
    """
    return tuple(dict.fromkeys(target for name in names for target in expand_sides(name)))


def expand_sides(target_name: str) -> tuple[str, ...]:
    """Return the names of the left and right targets for a name without a side; any other name unchanged."""
    return (
        tuple(f"{target_name}{side}" for side in TARGET_SIDES)
        if f"{target_name}Left" in _arkit_names()
        else (target_name,)
    )


@cache
def _arkit_names() -> frozenset[str]:
    names = target_deltas().names
    return frozenset(
        name.removeprefix(EXPRESSION_PREFIX) for name in names if name.startswith(EXPRESSION_PREFIX)
    )
