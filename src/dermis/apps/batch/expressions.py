"""What faces of data sets do: an expression as one face makes it, and muscles at random that do not work
against each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from math import exp

from dermis.base.tables import read_rows
from dermis.human.expressions import SIDES, Weights, sided

_JAW = "jawOpen"
_SCARCE = 1.5  # power of a uniform number that a weight at random is


@dataclass(frozen=True)
class Movement:
    """One of the rows of the table of mixtures."""

    chance: float
    most: float
    moves: Weights
    shuts: float


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
        for target in sided(name):
            side = 0.0 if target == name and not _is_side(name) else 1.0 - 2.0 * target.endswith("Right")
            found[target] = min(max(much * (1.0 + asymmetry * side), 0.0), 1.0)
    return found


def _is_side(name: str) -> bool:
    """Whether it is one of a pair, which mouthLeft and jawRight are not."""
    return any(name.endswith(side) for side in SIDES) and not name.startswith(
        ("jaw", "mouthLeft", "mouthRight")
    )
