"""Sampled parameters of each image: hashed random numbers, equal on every machine and in any order."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, partial
from math import exp

from scipy.special import ndtr, ndtri

from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.spec_tables import ANGLES, MIXTURE, NONE, RIG, table_of
from dermis.base.tables import read_rows
from dermis.human.expressions import SIDES, Weights, sided, targets_of

Parameters = dict[str, float | int | str]
_JAW = "jawOpen"
_SCARCE = 1.5  # power of a uniform number that a weight at random is
_BITS = 52  # which a double holds with half a step more
_PERSON = "person."
_SEEDS = 2**32
_DIALS = "intensity", "asymmetry", "variation"
_LAMPS = tuple(f"light.{lamp}." for lamp in ("key", "fill", "rim"))
_COLOUR = "background.red", "background.green", "background.blue"
_APPLIES: tuple[tuple[str | tuple[str, ...], Callable[[Parameters], bool]], ...] = (
    (_LAMPS, lambda found: found["light.kind"] == RIG),
    (("gaze.yaw_deg", "gaze.pitch_deg"), lambda found: found["gaze.at"] == ANGLES),
    (("environment.turn", "environment.strength"), lambda found: found["environment.name"] != NONE),
    (_COLOUR, lambda found: found["background.kind"] == "colour"),
    ("background.blur", lambda found: found["background.kind"] == "environment"),
    ("camera.frame_mm", lambda found: "camera.focal_mm" not in found),
)
"""Prefixes of parameters that only some images have, and the condition for them."""


def table_numbers(parameters: Mapping[str, float | int | str], table: str) -> dict[str, float]:
    """Return the parameters of a table that are numbers, by the rest of their names."""
    return {name: one for name, one in table_of(parameters, table).items() if not isinstance(one, str)}


def uniform(seed: int, number: int, name: str) -> float:
    """Return a uniform number in (0, 1) for a seed, the number of an image or a person, and a name.

    A hash of the three as text (BLAKE2b), so that no number depends on another.
    """
    digest = hashlib.blake2b(f"{seed} {number} {name}".encode(), digest_size=8).digest()
    whole = int.from_bytes(digest, "little") >> (64 - _BITS)
    return (whole + 0.5) / float(1 << _BITS)


def round_significant(value: float) -> float:
    """Round to six significant digits: the last ones of logarithms and roots differ between machines."""
    return float(f"{value:.6g}") + 0.0  # no -0.0


@dataclass(frozen=True)
class Movement:
    """Movement of a part of the face: a row of mixture.csv.

    chance : probability of this movement in its part
    most : greatest weight of its targets
    shuts : share by which it keeps the jaw from opening
    """

    chance: float
    most: float
    moves: Weights
    shuts: float


@cache
def load_movements() -> Mapping[str, tuple[Movement, ...]]:
    """Return the movements by part of the face."""
    found: dict[str, tuple[Movement, ...]] = {}
    for row in read_rows(str(__package__), "mixture"):
        words = row["moves"].split()
        weights = {name: float(share) for name, share in zip(words[::2], words[1::2], strict=True)}
        made = Movement(float(row["chance"]), float(row["most"]), weights, float(row["shuts"]))
        found[row["part"]] = (*found.get(row["part"], ()), made)
    return found


def random_expression(share: Callable[[str], float]) -> dict[str, float]:
    """Return random weights, with one movement or none in each part of the face.

    share : uniform number in (0, 1) for a name
    """
    found: dict[str, float] = {}
    opening = 1.0
    for part, movements in load_movements().items():
        left, amount = share(f"{part}.which"), share(f"{part}.weight") ** _SCARCE
        for one in movements:
            if 0 <= left < one.chance:
                found |= {name: one.most * amount * much for name, much in one.moves.items()}
                opening *= 1.0 - one.shuts * amount
            left -= one.chance
    if _JAW in found:
        found[_JAW] *= opening
    return found


def expression_weights(
    weights: Weights, intensity: float, asymmetry: float, variation: float, normal: Callable[[str], float]
) -> dict[str, float]:
    """Return the weights of targets, 0 to 1, of an expression varied for one face; see `ExpressionTable`.

    normal : standard normal number for a name
    """
    found = {}
    for name, weight in weights.items():
        much = weight * intensity * exp(variation * normal(name)) if weight else 0.0
        for target in sided(name):
            side = 0.0 if target == name and not _is_side(name) else 1.0 - 2.0 * target.endswith("Right")
            found[target] = min(max(much * (1.0 + asymmetry * side), 0.0), 1.0)
    return found


def _is_side(name: str) -> bool:
    """Return whether it is one of a pair, which mouthLeft and jawRight are not."""
    return name.endswith(SIDES) and not name.startswith(("jaw", "mouthLeft", "mouthRight"))


@dataclass(frozen=True)
class Sampler:
    """Sampler of the parameters of each image.

    images_per_person : consecutive images that show one person
    distributions : by name of their parameter
    correlated : by name the weights of the independent normal numbers of others, see `Correlated.rows`
    expressions : weights by name of the expression
    """

    seed: int
    images_per_person: int
    distributions: Mapping[str, Distribution]
    correlated: Mapping[str, Mapping[str, float]]
    expressions: Mapping[str, Weights]

    def parameters(self, k: int) -> Parameters:
        """Return the parameters of image k, which depend on nothing but their own names."""
        person = k // self.images_per_person
        found: Parameters = {"person.number": person}
        if "person.head" not in self.distributions:
            found["person.seed"] = int(uniform(self.seed, person, "person.seed") * _SEEDS)
        for name, one in self.distributions.items():
            if not name.startswith("pose."):
                found[name] = self._value(k, name, one)
        if found["background.kind"] == "environment" and found["environment.name"] == NONE:
            found["background.kind"] = "gradient"
        for names, applies in _APPLIES:
            if not applies(found):
                found = {name: value for name, value in found.items() if not name.startswith(names)}
        return found | {f"pose.{name}": weight for name, weight in self._weights(k, found).items()}

    def _value(self, k: int, name: str, one: Distribution) -> float | str:
        value = one.at(0.5 if isinstance(one, Constant) else self._quantile(k, name))
        return value if isinstance(value, str) else round_significant(value)

    def _quantile(self, k: int, name: str) -> float:
        """Return the share from 0 to 1 at which a parameter's distribution is read."""
        weights = self.correlated.get(name)
        if weights is None:
            return self._uniform(k, name)
        return float(ndtr(sum(weight * self._normal(k, other) for other, weight in weights.items())))

    def _uniform(self, k: int, name: str) -> float:
        number = k // self.images_per_person if name.startswith(_PERSON) else k
        return uniform(self.seed, number, name)

    def _normal(self, k: int, name: str) -> float:
        return float(ndtri(self._uniform(k, name)))

    def _weights(self, k: int, found: Parameters) -> dict[str, float]:
        """Return the weights of all morph targets that the spec can move."""
        name = str(found["expression.name"])
        if name == MIXTURE:
            weights: Weights = random_expression(lambda part: self._uniform(k, f"expression.mixture.{part}"))
        else:
            weights = self.expressions[name]
        intensity, asymmetry, variation = (float(found[f"expression.{dial}"]) for dial in _DIALS)
        normal = partial(self._variation, k)
        made: dict[str, float | str] = {**expression_weights(weights, intensity, asymmetry, variation, normal)}
        for target, one in table_of(self.distributions, "pose").items():
            made |= dict.fromkeys(targets_of([target]), self._value(k, f"pose.{target}", one))
        return {target: round_significant(float(made.get(target, 0.0))) for target in self.targets}

    def _variation(self, k: int, name: str) -> float:
        return self._normal(k, f"expression.variation.{name}")

    @cached_property
    def targets(self) -> tuple[str, ...]:
        """Names of all morph targets that the spec can move, sorted."""
        names = set(table_of(self.distributions, "pose"))
        for name in map(str, self.distributions["expression.name"].support):
            if name == MIXTURE:
                names |= {target for part in load_movements().values() for one in part for target in one.moves}
            else:
                names |= set(self.expressions[name])
        return tuple(sorted(targets_of(sorted(names))))
