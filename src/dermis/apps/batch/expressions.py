"""What faces do: expressions by name, and muscles at random that do not work against each other."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from math import exp

from dermis.base.tables import read_rows
from dermis.human.published import EXPRESSIONS, moves

Weights = Mapping[str, float]
_JAW = "jawOpen"
_SIDES = "Left", "Right"
_SCARCE = 1.5  # power of a uniform number that a weight at random is


@dataclass(frozen=True)
class Movement:
    """One of the rows of the table of mixtures."""

    chance: float
    most: float
    moves: Weights
    shuts: float


@cache
def package_expressions() -> Mapping[str, Weights]:
    """The package's expressions: weights by names of targets or of pairs of them."""
    text = resources.files(__package__).joinpath("expressions.toml").read_text("utf-8")
    return dict(tomllib.loads(text))


@cache
def mixture() -> Mapping[str, tuple[Movement, ...]]:
    """Movements by part of the face."""
    found: dict[str, tuple[Movement, ...]] = {}
    for row in read_rows(str(__package__), "mixture"):
        words = row["moves"].split()
        weights = {name: float(share) for name, share in zip(words[::2], words[1::2], strict=True)}
        made = Movement(float(row["chance"]), float(row["most"]), weights, float(row["shuts"]))
        found[row["part"]] = (*found.get(row["part"], ()), made)
    return found


def targets_of(names: Iterable[str]) -> tuple[str, ...]:
    """Targets by name; "mouthSmile" is two of them, left and right."""
    return tuple(dict.fromkeys(target for name in names for target in _both(name)))


def mixed(share: Callable[[str], float]) -> dict[str, float]:
    """Weights at random.

    share : a number between 0 and 1 by a name
    """
    found: dict[str, float] = {}
    opening = 1.0
    for part, movements in mixture().items():
        left, amount = share(f"{part}.which"), share(f"{part}.weight") ** _SCARCE
        for one in movements:
            if 0 <= left < one.chance:
                found |= {name: one.most * amount * much for name, much in one.moves.items()}
                opening *= 1.0 - one.shuts * amount
            left -= one.chance
    if _JAW in found:
        found[_JAW] *= opening
    return found


def performed(
    weights: Weights, intensity: float, asymmetry: float, variation: float, normal: Callable[[str], float]
) -> dict[str, float]:
    """Weights of targets, 0 to 1, of an expression as one face makes it; see `ExpressionTable`.

    normal : a number of the standard normal distribution by a name
    """
    found = {}
    for name, weight in weights.items():
        much = weight * intensity * exp(variation * normal(name)) if weight else 0.0
        for target in _both(name):
            side = 0.0 if target == name and not _is_side(name) else 1.0 - 2.0 * target.endswith("Right")
            found[target] = min(max(much * (1.0 + asymmetry * side), 0.0), 1.0)
    return found


def _both(name: str) -> tuple[str, ...]:
    return tuple(f"{name}{side}" for side in _SIDES) if f"{name}Left" in _arkit() else (name,)


def _is_side(name: str) -> bool:
    """Whether it is one of a pair, which mouthLeft and jawRight are not."""
    return any(name.endswith(side) for side in _SIDES) and not name.startswith(
        ("jaw", "mouthLeft", "mouthRight")
    )


@cache
def _arkit() -> frozenset[str]:
    """Names of the human's targets of expressions."""
    names = moves().names
    return frozenset(name.removeprefix(EXPRESSIONS) for name in names if name.startswith(EXPRESSIONS))
