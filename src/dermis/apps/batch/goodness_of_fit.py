"""Goodness of fit of the sampled parameters of a data set to the distributions of its spec."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, kolmogorov, ndtr

from dermis.apps.batch.distributions import Choice, Constant, Distribution, Files, Normal, Truncated, Uniform
from dermis.apps.batch.index import open_index
from dermis.apps.batch.sampling import round_significant
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import NONE
from dermis.human.expressions import targets_of

MIN_P_VALUE = 1e-6
"""p-value below which the values are reported as not of the distribution."""
_USUAL = sqrt(np.pi / 2) * np.log(2)  # mean of Kolmogorov's distribution
_GRID = 10_000  # shares that means are taken over
_HALF_DIGIT = 5e-6  # of a number, by which six digits move it at most
_MOST_NAMED = 12  # texts
_FEWEST = 5.0  # of a kind, expected, that count by themselves in chi-square

Array = NDArray[np.float64]
Values = Sequence[float | str]


class FitTest(NamedTuple):
    """Test of the sampled values of a parameter against its distribution.

    draws : images that have it, or people
    stated, found : mean and standard deviation, or shares of the values
    distance : of Kolmogorov and Smirnov, or the greatest difference of two shares [-]
    usual : mean of such distances for so many draws from the distribution [-]; 0 where there is none
    chance : p-value of the distance, or of a chi-square test of the shares [-]
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
        return self.chance >= MIN_P_VALUE


def fit_tests(out: Path, spec: Spec) -> Iterator[FitTest]:
    """Yield a test of each parameter that varies in the index of a data set.

    People count once, however many images show them. Raises DermisError where there is no index.
    """
    with open_index(out, "the statistics of a data set") as file:
        names = set(file.schema_arrow.names)
        first: NDArray[np.int64] | slice = slice(None)
        if "person.number" in names:  # rows of the first image of each person
            people = np.array(file.read(columns=["person.number"]).column(0).to_pylist(), np.int64)
            first = np.unique(people, return_index=True)[1]
        for name, law in spec.distributions.items():
            column = _column(name)
            if isinstance(law, Constant) or column not in names:
                continue
            values = np.array(file.read(columns=[column]).column(0).to_pylist(), object)
            drawn = values[first] if name.startswith("person.") else values
            there = [value for value in drawn if value is not None]
            if there:
                yield _spec_test(name, law, there, spec)


def fit_test(name: str, law: Distribution, values: Values) -> FitTest:
    """Return the test of values against the distribution that they were sampled from."""
    if any(isinstance(end, str) for end in law.support):
        return _shares_test(name, shares(law), [str(value) for value in values])
    return _numbers_test(name, law, np.sort(np.array(values, np.float64)))


def cdf(law: Distribution, x: Array, *, closed: bool) -> Array:
    """Return the cumulative distribution at `x`: the share below, or up to it where closed."""
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
            parts = (w * cdf(one, x, closed=closed) for one, w in zip(laws, weights, strict=True))
            return np.asarray(sum(parts) / sum(weights))
    raise TypeError(f"{law} has no numbers")


def shares(law: Distribution) -> dict[str, float]:
    """Return the probability of each text of a distribution."""
    if isinstance(law, Files):
        return dict.fromkeys(law.names, 1.0 / len(law.names))
    found = defaultdict[str, float](float)
    for one, weight in zip(law.values, law.weights, strict=True) if isinstance(law, Choice) else [(law, 1.0)]:
        for text, share in ({str(one.at(0.5)): 1.0} if isinstance(one, Constant) else shares(one)).items():
            found[text] += weight * share
    total = sum(found.values())
    return {text: share / total for text, share in found.items() if share}


def _spec_test(name: str, law: Distribution, values: Values, spec: Spec) -> FitTest:
    if name != "background.kind" or NONE not in spec.distributions["environment.name"].support:
        return fit_test(name, law, values)
    plain = {"environment": "gradient"}  # without an environment, see `Sampler.parameters`
    stated = defaultdict[str, float](float)
    for text, share in shares(law).items():
        stated[plain.get(text, text)] += share
    return _shares_test(name, stated, [plain.get(str(value), str(value)) for value in values])


def _numbers_test(name: str, law: Distribution, values: Array) -> FitTest:
    """Return the Kolmogorov-Smirnov test of sorted values, which are rounded to six digits."""
    count, near = len(values), _HALF_DIGIT * np.abs(values)
    up_to = np.searchsorted(values, values, "right") / count
    below = np.searchsorted(values, values, "left") / count
    over = up_to - cdf(law, values + near, closed=True)
    under = cdf(law, values - near, closed=False) - below
    distance = float(max(over.max(), under.max(), 0.0))
    grid: Array = np.array([law.at((k + 0.5) / _GRID) for k in range(_GRID)], np.float64)
    chance = float(kolmogorov(sqrt(count) * distance))
    stated, found = _moments(grid), _moments(values)
    return FitTest(name, count, stated, found, distance, float(_USUAL / sqrt(count)), chance)


def _shares_test(name: str, stated: Mapping[str, float], values: Sequence[str]) -> FitTest:
    """Return the chi-square test of texts against their probabilities."""
    count, counts = len(values), Counter(values)
    distance = max(abs(counts[text] / count - stated.get(text, 0.0)) for text in {*stated, *counts})
    usual = max(sqrt(2 / np.pi * share * (1 - share) / count) for share in stated.values())
    chance = 0.0 if counts.keys() - stated.keys() else _chi_square(stated, counts, count)
    found = {text: counts[text] / count for text in stated}
    return FitTest(name, count, _listed(stated), _listed(found), distance, usual, chance)


def _listed(found: Mapping[str, float]) -> str:
    return ", ".join(f"{text} {found[text]:.3g}" for text in sorted(found)[:_MOST_NAMED])


def _chi_square(stated: Mapping[str, float], found: Counter[str], count: int) -> float:
    """Return the p-value of counts against their probabilities; rare texts are pooled."""
    cells = [(found[text], count * share) for text, share in stated.items() if count * share >= _FEWEST]
    rest = count - sum(one for one, _ in cells), count - sum(mean for _, mean in cells)
    if rest[1] > _FEWEST or rest[0]:
        cells.append(rest)
    if len(cells) < 2:
        return 1.0
    square = sum((one - mean) ** 2 / max(mean, 1.0) for one, mean in cells)
    return float(chdtrc(len(cells) - 1, square))


def _moments(values: Array) -> str:
    return f"{round_significant(float(values.mean())):.5g}, {round_significant(float(values.std())):.5g}"


def _column(name: str) -> str:
    """Return the column of a parameter; a pair of targets has two, which are equal."""
    start, _, target = name.partition(".")
    return f"pose.{targets_of([target])[0]}" if start == "pose" else name
