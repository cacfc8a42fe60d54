"""Distributions as a spec writes them: a value, or a table such as {uniform = [0, 1]}."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from math import exp, isfinite, log
from typing import TypeGuard

from scipy.special import ndtr, ndtri

Value = float | str
SpecValue = float | str | dict[str, object]
"""A distribution as TOML writes it."""
_WIDEST = 6.0  # standard deviations that a normal distribution reaches
_LEAST_SHARE = 1e-6
_MOST_CHOICES = 100_000


def require(holds: bool, expected: str) -> None:
    """Raise ValueError with what was expected, unless it holds."""
    if not holds:
        raise ValueError(expected)


class Distribution(ABC):
    """Distribution that a parameter is sampled from."""

    @property
    @abstractmethod
    def support(self) -> tuple[Value, ...]:
        """Return the least and the greatest number, or all texts, that can be sampled."""

    @abstractmethod
    def at(self, share: float) -> Value:
        """Return the quantile of a share from 0 to 1."""

    @abstractmethod
    def spec_value(self) -> SpecValue:
        """Return what TOML writes; `parse_distribution` reads it as the same distribution."""


@dataclass(frozen=True)
class Constant(Distribution):
    """Constant value."""

    value: Value

    @property
    def support(self) -> tuple[Value, ...]:
        return (self.value,)

    def at(self, share: float) -> Value:
        return self.value

    def spec_value(self) -> SpecValue:
        return self.value if isinstance(self.value, str) else float(self.value)


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform between two numbers, or uniform in the logarithm."""

    low: float
    high: float
    logarithmic: bool = False

    def __post_init__(self) -> None:
        require(self.low < self.high, "a low end that is less than the high one")
        require(self.low > 0 or not self.logarithmic, "ends above 0 for log_uniform")

    @property
    def support(self) -> tuple[Value, ...]:
        return self.low, self.high

    def at(self, share: float) -> float:
        if not self.logarithmic:
            return self.low + share * (self.high - self.low)
        low, high = log(self.low), log(self.high)
        return min(max(exp(low + share * (high - low)), self.low), self.high)

    def spec_value(self) -> SpecValue:
        return {"log_uniform" if self.logarithmic else "uniform": _floats(self.low, self.high)}


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal, clamped to six standard deviations."""

    mean: float
    sd: float

    def __post_init__(self) -> None:
        require(self.sd > 0, "a standard deviation above 0")

    @property
    def support(self) -> tuple[Value, ...]:
        return self.mean - _WIDEST * self.sd, self.mean + _WIDEST * self.sd

    def at(self, share: float) -> float:
        return self.mean + self.sd * min(max(float(ndtri(share)), -_WIDEST), _WIDEST)

    def spec_value(self) -> SpecValue:
        return {"normal": _floats(self.mean, self.sd)}


@dataclass(frozen=True)
class Truncated(Distribution):
    """Truncated normal: values beyond the two ends are not sampled, rather than clamped."""

    mean: float
    sd: float
    low: float
    high: float

    def __post_init__(self) -> None:
        require(self.sd > 0, "a standard deviation above 0")
        require(self.low < self.high, "a low end that is less than the high one")
        require(
            self._shares[1] - self._shares[0] >= _LEAST_SHARE,
            f"ends between which at least {_LEAST_SHARE:g} of the distribution lies",
        )

    @property
    def _shares(self) -> tuple[float, float]:
        """Cumulative probability of the normal at each end, mirrored where both are above the mean."""
        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        return (float(ndtr(-high)), float(ndtr(-low))) if low > 0 else (float(ndtr(low)), float(ndtr(high)))

    @property
    def support(self) -> tuple[Value, ...]:
        return self.low, self.high

    def at(self, share: float) -> float:
        below, above = self._shares
        if self.low > self.mean:
            away = -float(ndtri(above - share * (above - below)))
        else:
            away = float(ndtri(below + share * (above - below)))
        return min(max(self.mean + self.sd * away, self.low), self.high)

    def spec_value(self) -> SpecValue:
        return {"truncated": _floats(self.mean, self.sd, self.low, self.high)}


@dataclass(frozen=True)
class Choice(Distribution):
    """Mixture of distributions, mostly constants; the weights need not sum to 1."""

    values: tuple[Distribution, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        require(0 < len(self.values) <= _MOST_CHOICES, f"1 to {_MOST_CHOICES:,} values to choose from")
        require(len(self.weights) == len(self.values), f"as many weights as values ({len(self.values)})")
        require(min(self.weights) >= 0 and sum(self.weights) > 0, "weights from 0, one of them above it")
        require(
            len({isinstance(end, str) for value in self.values for end in value.support}) <= 1,
            "either numbers or texts to choose from",
        )

    @property
    def support(self) -> tuple[Value, ...]:
        found = [end for value in self.values for end in value.support]
        if isinstance(found[0], str):
            return tuple(dict.fromkeys(found))
        return min(found), max(found)

    def at(self, share: float) -> Value:
        reached = list(accumulate(self.weights))
        place = share * reached[-1]
        index = bisect_right(reached, place)
        while index >= len(reached) or not self.weights[index]:  # past the last one by rounding
            index -= 1
        within = (place - (reached[index] - self.weights[index])) / self.weights[index]
        return self.values[index].at(min(max(within, 2.0**-53), 1.0 - 2.0**-53))

    def spec_value(self) -> SpecValue:
        return {"choice": [one.spec_value() for one in self.values], "weights": _floats(*self.weights)}


@dataclass(frozen=True, repr=False)
class Files(Distribution):
    """One of the files that match a pattern, with equal probability.

    names : relative to the spec's folder, sorted; empty until the pattern is resolved
    """

    pattern: str
    names: tuple[str, ...] = ()

    @property
    def support(self) -> tuple[Value, ...]:
        return self.names

    def at(self, share: float) -> str:
        return self.names[min(int(share * len(self.names)), len(self.names) - 1)]

    def spec_value(self) -> SpecValue:
        return {"files": self.pattern}

    def __repr__(self) -> str:
        return repr(self.spec_value())


def _floats(*values: float) -> list[float]:
    return list(map(float, values))


_MOST = 1e9  # of a number
_FORMS = (
    "a number, a text, or one of {uniform = [low, high]}, {log_uniform = [low, high]}, "
    "{normal = [mean, sd]}, {truncated = [mean, sd, low, high]}, {choice = [...], weights = [...]} "
    "and {files = PATTERN}"
)
_NUMBERS: Mapping[str, tuple[int, Callable[..., Distribution]]] = {
    "uniform": (2, Uniform),
    "log_uniform": (2, lambda low, high: Uniform(low, high, True)),
    "normal": (2, Normal),
    "truncated": (4, Truncated),
}


def parse_distribution(value: object, nested: bool = False) -> Distribution:
    """Return the distribution that a value of a spec describes.

    nested : it is one of the values of a choice, which cannot be a choice or files

    Raises ValueError, worded as what was expected, for values that describe none.
    """
    if isinstance(value, Distribution):
        return value
    if isinstance(value, str):
        return Constant(value)
    if _is_number(value):
        return Constant(float(value))
    table: Mapping[str, object] = value if isinstance(value, Mapping) else {}
    kind = next(iter(table), "")
    if kind in _NUMBERS and len(table) == 1:
        count, make = _NUMBERS[kind]
        return make(*_numbers(table[kind], f"{count} numbers in {kind}", count))
    if nested:
        raise ValueError(_FORMS)
    if kind == "files" and len(table) == 1 and isinstance(table[kind], str):
        return Files(str(table[kind]))
    if "choice" in table and table.keys() <= {"choice", "weights"}:
        values = table["choice"]
        if not isinstance(values, list | tuple):
            raise ValueError("a list in choice")
        weights = table.get("weights")
        shares = [1.0] * len(values) if weights is None else _numbers(weights, "a list of numbers in weights")
        return Choice(tuple(parse_distribution(one, True) for one in values), tuple(shares))
    raise ValueError(_FORMS)


def _numbers(values: object, expected: str, count: int | None = None) -> list[float]:
    """Return a list of numbers as floats, or raise ValueError with what was expected."""
    if not isinstance(values, list | tuple) or count not in (None, len(values)):
        raise ValueError(expected)
    numbers = [float(one) for one in values if _is_number(one)]
    if len(numbers) != len(values):
        raise ValueError(f"{expected}, none beyond {_MOST:g}" if count else expected)
    return numbers


def _is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return isfinite(value) and abs(value) <= _MOST
