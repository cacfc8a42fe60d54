"""Goodness of fit of the sampled parameters of a data set to the distributions of its spec."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from math import sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, kolmogorov, ndtr

from dermis.apps.batch.distributions import Choice, Constant, Distribution, Files, Normal, Truncated, Uniform
from dermis.apps.batch.index import index_file
from dermis.apps.batch.sampling import rounded
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import NONE
from dermis.human.expressions import targets_of

LEAST_CHANCE = 1e-6
"""Below it, what was drawn is not what is stated."""
_USUAL = sqrt(np.pi / 2) * np.log(2)  # mean of Kolmogorov's distribution
_GRID = 10_000  # shares that means are taken over
_HALF_DIGIT = 5e-6  # of a number, by which six digits move it at most
_MOST_NAMED = 12  # texts
_FEWEST = 5.0  # of a kind, expected, that count by themselves in chi-square

Array = NDArray[np.float64]


class FitTest(NamedTuple):
    """A parameter as it is stated and as it was found.

    draws : images that have it, or people
    stated, found : mean and standard deviation, or how often the values come
    distance : of Kolmogorov and Smirnov, or the greatest difference of two shares [-]
    usual : the mean of such distances for so many draws from what is stated [-]; 0 where there is none
    chance : that one is at least as great, were all drawn from what is stated [-]
    """

    parameter: str
    draws: int
    stated: str
    found: str
    distance: float
    usual: float
    chance: float

    @property
    def agrees(self) -> bool:
        return self.chance >= LEAST_CHANCE


def fit_tests(out: Path, spec: Spec) -> Iterator[FitTest]:
    """Each parameter that varies in the index of a data set, against its own distribution in the spec.

    People count once, however many images show them. Raises DermisError where there is no index.
    """
    with index_file(out, "the statistics of a data set") as file:
        names = set(file.schema_arrow.names)
        first = _of_people(file) if "person.number" in names else slice(None)
        for name, law in spec.distributions.items():
            column = _column(name)
            if isinstance(law, Constant) or column not in names:
                continue
            values = np.array(file.read(columns=[column]).column(0).to_pylist(), object)
            drawn = values[first] if name.startswith("person.") else values
            there = [value for value in drawn if value is not None]
            if there:
                yield _compared(name, law, there, spec)


def fit_test(name: str, law: Distribution, values: Sequence[Any]) -> FitTest:
    """Values of a parameter against the distribution that they were drawn from, one by one."""
    if any(isinstance(end, str) for end in law.ends):
        return _texts(name, shares(law), [str(value) for value in values])
    return _numbers(name, law, np.sort(np.array(values, np.float64)))


def share_below(law: Distribution, x: Array, *, closed: bool) -> Array:
    """Of all numbers of a distribution, the share below each of `x`, or up to it where closed."""
    match law:
        case Constant(value):
            at = float(value)
            return ((x >= at) if closed else (x > at)).astype(np.float64)
        case Uniform(low, high, logarithmic):
            if logarithmic:
                low, high, x = np.log(low), np.log(high), np.log(np.maximum(x, low))
            return np.clip((x - low) / (high - low), 0.0, 1.0)
        case Normal(mean, sd):
            return np.asarray(ndtr((x - mean) / sd))
        case Truncated(mean, sd, low, high):
            z, first, last = ((one - mean) / sd for one in (np.clip(x, low, high), low, high))
            if first > 0:  # far from the mean, differences to 1 lose their digits
                return np.asarray((ndtr(-first) - ndtr(-z)) / (ndtr(-first) - ndtr(-last)))
            return np.asarray((ndtr(z) - ndtr(first)) / (ndtr(last) - ndtr(first)))
        case Choice(laws, weights):
            parts = (w * share_below(one, x, closed=closed) for one, w in zip(laws, weights, strict=True))
            return np.asarray(sum(parts) / sum(weights))
    raise TypeError(f"{law} has no numbers")


def shares(law: Distribution) -> dict[str, float]:
    """Of each text of a distribution."""
    if isinstance(law, Files):
        return dict.fromkeys(law.names, 1.0 / len(law.names))
    found = Counter[str]()
    for one, weight in zip(law.values, law.weights, strict=True) if isinstance(law, Choice) else [(law, 1.0)]:
        for text, share in ({str(one.at(0.5)): 1.0} if isinstance(one, Constant) else shares(one)).items():
            found[text] += weight * share  # type: ignore[assignment]
    total = sum(found.values())
    return {text: share / total for text, share in found.items() if share}


def _compared(name: str, law: Distribution, values: Sequence[Any], spec: Spec) -> FitTest:
    if name != "background.kind" or NONE not in spec.distributions["environment.name"].ends:
        return fit_test(name, law, values)
    plain = {"environment": "gradient"}  # where there is no environment, see `Drawing.parameters`
    stated = Counter[str]()
    for text, share in shares(law).items():
        stated[plain.get(text, text)] += share  # type: ignore[assignment]
    return _texts(name, dict(stated), [plain.get(value, value) for value in values])


def _numbers(name: str, law: Distribution, values: Array) -> FitTest:
    """values : sorted"""
    count, near = len(values), _HALF_DIGIT * np.abs(values)
    up_to = np.searchsorted(values, values, "right") / count
    below = np.searchsorted(values, values, "left") / count
    over = up_to - share_below(law, values + near, closed=True)
    under = share_below(law, values - near, closed=False) - below
    distance = float(max(over.max(), under.max(), 0.0))
    grid: Array = np.array([law.at((k + 0.5) / _GRID) for k in range(_GRID)], np.float64)
    chance = float(kolmogorov(sqrt(count) * distance))
    stated, found = _moments(grid), _moments(values)
    return FitTest(name, count, stated, found, distance, float(_USUAL / sqrt(count)), chance)


def _texts(name: str, stated: dict[str, float], values: Sequence[str]) -> FitTest:
    count, found = len(values), Counter(values)
    distance = max(abs(found[text] / count - stated.get(text, 0.0)) for text in {*stated, *found})
    usual = max(sqrt(2 / np.pi * share * (1 - share) / count) for share in stated.values())
    chance = 0.0 if found.keys() - stated.keys() else _chi_square(stated, found, count)
    came = {text: found[text] / count for text in stated}
    return FitTest(name, count, _told(stated), _told(came), distance, usual, chance)


def _told(of: dict[str, float]) -> str:
    return ", ".join(f"{text} {of[text]:.3g}" for text in sorted(of)[:_MOST_NAMED])


def _chi_square(stated: dict[str, float], found: Counter[str], count: int) -> float:
    """The chance of counts as far from their shares; rare texts count as one."""
    cells = [(found[text], count * share) for text, share in stated.items() if count * share >= _FEWEST]
    rest = count - sum(one for one, _ in cells), count - sum(mean for _, mean in cells)
    if rest[1] > _FEWEST or rest[0]:
        cells.append(rest)
    if len(cells) < 2:
        return 1.0
    square = sum((one - mean) ** 2 / max(mean, 1.0) for one, mean in cells)
    return float(chdtrc(len(cells) - 1, square))


def _moments(values: Array) -> str:
    return f"{rounded(float(values.mean())):.5g}, {rounded(float(values.std())):.5g}"


def _of_people(file: Any) -> NDArray[np.int64]:
    """Rows of the first image of each person."""
    numbers = np.array(file.read(columns=["person.number"]).column(0).to_pylist(), np.int64)
    return np.unique(numbers, return_index=True)[1]


def _column(name: str) -> str:
    """Of a parameter; a pair of targets has two, which are alike."""
    start, _, target = name.partition(".")
    return f"pose.{targets_of([target])[0]}" if start == "pose" else name
