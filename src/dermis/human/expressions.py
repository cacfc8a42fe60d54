"""Expressions by name: weights of the human's targets, or of pairs of them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources

from dermis.base.registry import Registry
from dermis.human.published import FACE_UNITS, moves

Weights = Mapping[str, float]
SIDES = "Left", "Right"
EXPRESSIONS: Registry[Weights] = Registry(
    "expression", tomllib.loads(resources.files(__package__).joinpath("expressions.toml").read_text("utf-8"))
)
"""Those of expressions.toml; another package registers its own."""


def expression(name: str) -> dict[str, float]:
    """Return the weights of all targets of an expression, as `Pose` takes them.

    Raises DermisError for an unknown name.
    """
    return {target: weight for one, weight in EXPRESSIONS[name].items() for target in sided(one)}


def targets_of(names: Iterable[str]) -> tuple[str, ...]:
    """Return targets by name; "mouthSmile" is two of them, left and right."""
    return tuple(dict.fromkeys(target for name in names for target in sided(name)))


def sided(name: str) -> tuple[str, ...]:
    """Return both targets of a pair, or the target itself."""
    return tuple(f"{name}{side}" for side in SIDES) if f"{name}Left" in _arkit() else (name,)


@cache
def _arkit() -> frozenset[str]:
    names = moves().names
    return frozenset(name.removeprefix(FACE_UNITS) for name in names if name.startswith(FACE_UNITS))
