"""Sampled parameters of each image: hashed random numbers, equal on every machine and in any order."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from scipy.special import ndtr, ndtri

from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.expressions import mixed, mixture, performed
from dermis.apps.batch.spec_tables import ANGLES, MIXTURE, NONE, RIG
from dermis.human.expressions import Weights, targets_of

_BITS = 52  # which a double holds with a half more
_DIGITS = 6


def uniform(seed: int, number: int, name: str) -> float:
    """A number between 0 and 1, both left out, by a seed, the number of an image or a person, and a name.

    A hash of the three as text (BLAKE2b), so that no draw moves another.
    """
    digest = hashlib.blake2b(f"{seed} {number} {name}".encode(), digest_size=8).digest()
    whole = int.from_bytes(digest, "little") >> (64 - _BITS)
    return (whole + 0.5) / float(1 << _BITS)


def rounded(value: float) -> float:
    """To six significant digits: the last ones of logarithms and roots differ from machine to machine."""
    return float(f"{value:.{_DIGITS}g}") + 0.0  # no -0.0


Parameters = dict[str, float | int | str]
_PERSON = "person."
_SEEDS = 2**32
_DIALS = "intensity", "asymmetry", "variation"
_LAMPS = tuple(f"light.{lamp}." for lamp in ("key", "fill", "rim"))
_COLOUR = "background.red", "background.green", "background.blue"
_APPLIES: tuple[tuple[str | tuple[str, ...], Callable[[Parameters], bool]], ...] = (
    (_LAMPS, lambda drawn: drawn["light.kind"] == RIG),
    (("gaze.yaw_deg", "gaze.pitch_deg"), lambda drawn: drawn["gaze.at"] == ANGLES),
    (("environment.turn", "environment.strength"), lambda drawn: drawn["environment.name"] != NONE),
    (_COLOUR, lambda drawn: drawn["background.kind"] == "colour"),
    ("background.blur", lambda drawn: drawn["background.kind"] == "environment"),
    ("camera.frame_mm", lambda drawn: "camera.focal_mm" not in drawn),
)
"""Parameters that only some images have, and which do."""


@dataclass(frozen=True)
class Sampler:
    """All that is drawn for an image.

    images_per_person : of which each person is seen in
    drawn : distributions by name of their parameter
    correlated : by name the factors of the normal numbers of others that make its own
    expressions : weights by name of the expression
    """

    seed: int
    images_per_person: int
    drawn: Mapping[str, Distribution]
    correlated: Mapping[str, Mapping[str, float]]
    expressions: Mapping[str, Weights]

    def parameters(self, k: int) -> Parameters:
        """Of image k: the same on every machine, whatever else is drawn."""
        person = k // self.images_per_person
        found: Parameters = {"person.number": person}
        if "person.head" not in self.drawn:
            found["person.seed"] = int(uniform(self.seed, person, "person.seed") * _SEEDS)
        for name, one in self.drawn.items():
            if not name.startswith("pose."):
                found[name] = self._value(k, name, one)
        if found["background.kind"] == "environment" and found["environment.name"] == NONE:
            found["background.kind"] = "gradient"
        for names, applies in _APPLIES:
            if not applies(found):
                found = {name: value for name, value in found.items() if not name.startswith(names)}
        return found | {f"pose.{name}": weight for name, weight in self._weights(k, found).items()}

    def _value(self, k: int, name: str, one: Distribution) -> float | str:
        value = one.at(0.5 if isinstance(one, Constant) else self._share(k, name))
        return value if isinstance(value, str) else rounded(value)

    def _share(self, k: int, name: str) -> float:
        """The number between 0 and 1 by which a parameter is drawn."""
        factors = self.correlated.get(name)
        if factors is None:
            return self._uniform(k, name)
        return float(ndtr(sum(much * self._normal(k, other) for other, much in factors.items())))

    def _uniform(self, k: int, name: str) -> float:
        number = k // self.images_per_person if name.startswith(_PERSON) else k
        return uniform(self.seed, number, name)

    def _normal(self, k: int, name: str) -> float:
        return float(ndtri(self._uniform(k, name)))

    def _weights(self, k: int, found: Parameters) -> dict[str, float]:
        """Of all targets that the spec can move."""
        name: Any = found["expression.name"]
        if name == MIXTURE:
            weights: Weights = mixed(lambda part: self._uniform(k, f"expression.mixture.{part}"))
        else:
            weights = self.expressions[name]
        intensity, asymmetry, variation = (float(found[f"expression.{dial}"]) for dial in _DIALS)
        made = performed(weights, intensity, asymmetry, variation, partial(self._varied, k))
        for target, one in self._own.items():
            drawn: Any = self._value(k, f"pose.{target}", one)
            made |= dict.fromkeys(targets_of([target]), drawn)
        return {target: rounded(made.get(target, 0.0)) for target in self.targets}

    def _varied(self, k: int, name: str) -> float:
        return self._normal(k, f"expression.variation.{name}")

    @cached_property
    def _own(self) -> dict[str, Distribution]:
        return {name[5:]: one for name, one in self.drawn.items() if name.startswith("pose.")}

    @cached_property
    def targets(self) -> tuple[str, ...]:
        """Names of all targets that the spec can move, sorted."""
        names = {name for end in self.drawn["expression.name"].ends for name in self._moved(str(end))}
        return tuple(sorted(targets_of(sorted(names | self._own.keys()))))

    def _moved(self, name: str) -> set[str]:
        """Targets or pairs of an expression."""
        if name != MIXTURE:
            return set(self.expressions[name])
        return {target for part in mixture().values() for one in part for target in one.moves}
