"""Distributions as a spec states them: a value, or a table such as {uniform = [0, 1]}."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from math import exp, isfinite, log
from typing import Any

from scipy.special import ndtr, ndtri

Value = float | str
_WIDEST = 6.0  # standard deviations that a normal distribution reaches
_LEAST_SHARE = 1e-6
_MOST_CHOICES = 100_000


class Distribution(ABC):
    """What a parameter is drawn from."""

    @property
    @abstractmethod
    def ends(self) -> tuple[Value, ...]:
        """The least and the greatest number, or all texts, that can be drawn."""

    @abstractmethod
    def at(self, share: float) -> Value:
        """The value below which a share of all lies, 0 to 1."""

    @abstractmethod
    def told(self) -> Any:
        """As TOML states it; `stated` of it is the same again."""


@dataclass(frozen=True)
class Constant(Distribution):
    """Always the same."""

    value: Value

    @property
    def ends(self) -> tuple[Value, ...]:
        return (self.value,)

    def at(self, share: float) -> Value:
        return self.value

    def told(self) -> Value:
        return self.value if isinstance(self.value, str) else float(self.value)


@dataclass(frozen=True)
class Uniform(Distribution):
    """Evenly between two numbers, or evenly in their logarithm."""

    low: float
    high: float
    logarithmic: bool = False

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError("a low end that is less than the high one")
        if self.logarithmic and self.low <= 0:
            raise ValueError("ends above 0 for log_uniform")

    @property
    def ends(self) -> tuple[Value, ...]:
        return self.low, self.high

    def at(self, share: float) -> float:
        if not self.logarithmic:
            return self.low + share * (self.high - self.low)
        low, high = log(self.low), log(self.high)
        return min(max(exp(low + share * (high - low)), self.low), self.high)

    def told(self) -> dict[str, Any]:
        return {"log_uniform" if self.logarithmic else "uniform": _floats(self.low, self.high)}


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal, within six standard deviations."""

    mean: float
    sd: float

    def __post_init__(self) -> None:
        if self.sd <= 0:
            raise ValueError("a standard deviation above 0")

    @property
    def ends(self) -> tuple[Value, ...]:
        return self.mean - _WIDEST * self.sd, self.mean + _WIDEST * self.sd

    def at(self, share: float) -> float:
        return self.mean + self.sd * min(max(float(ndtri(share)), -_WIDEST), _WIDEST)

    def told(self) -> dict[str, Any]:
        return {"normal": _floats(self.mean, self.sd)}


@dataclass(frozen=True)
class Truncated(Distribution):
    """Normal between two ends, to which nothing is moved: what lies beyond is not drawn."""

    mean: float
    sd: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.sd <= 0:
            raise ValueError("a standard deviation above 0")
        if not self.low < self.high:
            raise ValueError("a low end that is less than the high one")
        if self._shares[1] - self._shares[0] < _LEAST_SHARE:
            raise ValueError(f"ends between which at least {_LEAST_SHARE:g} of the distribution lies")

    @property
    def _shares(self) -> tuple[float, float]:
        """Of the whole normal distribution below each end, mirrored where both are above the mean."""
        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        return (float(ndtr(-high)), float(ndtr(-low))) if low > 0 else (float(ndtr(low)), float(ndtr(high)))

    @property
    def ends(self) -> tuple[Value, ...]:
        return self.low, self.high

    def at(self, share: float) -> float:
        below, above = self._shares
        if self.low > self.mean:
            away = -float(ndtri(above - share * (above - below)))
        else:
            away = float(ndtri(below + share * (above - below)))
        return min(max(self.mean + self.sd * away, self.low), self.high)

    def told(self) -> dict[str, Any]:
        return {"truncated": _floats(self.mean, self.sd, self.low, self.high)}


@dataclass(frozen=True)
class Choice(Distribution):
    """One of several distributions, values mostly, by weights that need not add up to 1."""

    values: tuple[Distribution, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        if not 0 < len(self.values) <= _MOST_CHOICES:
            raise ValueError(f"1 to {_MOST_CHOICES:,} values to choose from")
        if len(self.weights) != len(self.values):
            raise ValueError(f"as many weights as values ({len(self.values)})")
        if min(self.weights) < 0 or not sum(self.weights) > 0:
            raise ValueError("weights from 0, one of them above it")
        if len({isinstance(end, str) for value in self.values for end in value.ends}) > 1:
            raise ValueError("either numbers or texts to choose from")

    @property
    def ends(self) -> tuple[Value, ...]:
        found = [end for value in self.values for end in value.ends]
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

    def told(self) -> dict[str, Any]:
        values = [value.told() for value in self.values]
        return {"choice": values, "weights": _floats(*self.weights)}


@dataclass(frozen=True, repr=False)
class Files(Distribution):
    """One of the files of a pattern, each alike.

    names : relative to the spec's folder, sorted; none until the folder is looked into
    """

    pattern: str
    names: tuple[str, ...] = ()

    @property
    def ends(self) -> tuple[Value, ...]:
        return self.names

    def at(self, share: float) -> str:
        return self.names[min(int(share * len(self.names)), len(self.names) - 1)]

    def told(self) -> dict[str, Any]:
        return {"files": self.pattern}

    def __repr__(self) -> str:
        return repr(self.told())


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


def parse_distribution(told: Any, deep: bool = False) -> Distribution:
    """What a spec's value says.

    deep : it is one of a choice's values, which do not choose further

    Raises ValueError, worded as what was expected, for values that state none.
    """
    if isinstance(told, Distribution):
        return told
    if isinstance(told, str) or _is_number(told):
        return Constant(told if isinstance(told, str) else float(told))
    kind = next(iter(told)) if isinstance(told, Mapping) and told else ""
    if kind in _NUMBERS and len(told) == 1:
        count, made = _NUMBERS[kind]
        if not isinstance(told[kind], list | tuple) or len(told[kind]) != count:
            raise ValueError(f"{count} numbers in {kind}")
        if not all(map(_is_number, told[kind])):
            raise ValueError(f"{count} numbers in {kind}, none beyond {_MOST:g}")
        return made(*map(float, told[kind]))
    if kind == "files" and len(told) == 1 and isinstance(told[kind], str) and not deep:
        return Files(told[kind])
    if not deep and isinstance(told, Mapping) and "choice" in told and told.keys() <= {"choice", "weights"}:
        return _choice(told)
    raise ValueError(_FORMS)


def _choice(told: Mapping[str, Any]) -> Choice:
    values, weights = told["choice"], told.get("weights")
    if not isinstance(values, list | tuple):
        raise ValueError("a list in choice")
    if weights is None:
        weights = [1.0] * len(values)
    if not isinstance(weights, list | tuple) or not all(map(_is_number, weights)):
        raise ValueError("a list of numbers in weights")
    return Choice(tuple(parse_distribution(value, True) for value in values), tuple(map(float, weights)))


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and isfinite(value)
        and abs(value) <= _MOST
    )
