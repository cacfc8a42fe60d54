"""Probability distributions in a spec, written as a constant or a TOML table such as {uniform = [0, 1]}."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from math import exp, isfinite, log
from typing import TypeGuard

from scipy.special import ndtr, ndtri

SampleValue = float | str
SpecValue = float | str | dict[str, object]
"""Distribution as a TOML value."""
_MAX_STANDARD_DEVIATIONS = 6.0  # limit of normal samples in standard deviations
_MIN_INTERVAL_PROBABILITY = 1e-6  # smallest probability of the untruncated normal between the limits
_MAX_CHOICES = 100_000


def require(condition: bool, expected_text: str) -> None:
    """Raise ValueError unless a condition is true.

    expected_text : description of the valid values, for the message
    """
    if not condition:
        raise ValueError(expected_text)


class Distribution(ABC):
    """Base class of the distributions from which parameters are sampled."""

    @property
    @abstractmethod
    def support(self) -> tuple[SampleValue, ...]:
        """Return the smallest and the largest possible number, or all possible strings."""

    @abstractmethod
    def quantile(self, probability: float) -> SampleValue:
        """Return the sample that belongs to a probability between 0 and 1.

        For random, uniform probabilities, the samples have this distribution. For a distribution of numbers,
        the result is the quantile: a sample lies below it with the given probability.
        """

    @abstractmethod
    def spec_value(self) -> SpecValue:
        """Return the TOML value that `parse_distribution` converts to this distribution."""


@dataclass(frozen=True)
class Constant(Distribution):
    """Distribution whose samples are always the same number or string."""

    value: SampleValue

    @property
    def support(self) -> tuple[SampleValue, ...]:
        """Return the constant as the only sample."""
        return (self.value,)

    def quantile(self, probability: float) -> SampleValue:
        """Return the constant, whatever the probability."""
        return self.value

    def spec_value(self) -> SpecValue:
        """Return the constant itself."""
        return self.value if isinstance(self.value, str) else float(self.value)


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform distribution of a number, or of its logarithm, between two limits."""

    low: float
    high: float
    logarithmic: bool = False

    def __post_init__(self) -> None:
        """Check that the limits are ordered and, if the distribution is logarithmic, positive."""
        require(self.low < self.high, "a lower limit that is less than the upper limit")
        require(self.low > 0 or not self.logarithmic, "limits above 0 for log_uniform")

    @property
    def support(self) -> tuple[SampleValue, ...]:
        """Return the two limits."""
        return self.low, self.high

    def quantile(self, probability: float) -> float:
        """Return the number below which a sample lies with a given probability between 0 and 1."""
        if not self.logarithmic:
            return self.low + probability * (self.high - self.low)
        low, high = log(self.low), log(self.high)
        return min(max(exp(low + probability * (high - low)), self.low), self.high)

    def spec_value(self) -> SpecValue:
        """Return the TOML table with the key `uniform` or `log_uniform`."""
        return {"log_uniform" if self.logarithmic else "uniform": _float_list(self.low, self.high)}


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal distribution, clamped at six standard deviations from the mean."""

    mean: float
    sd: float

    def __post_init__(self) -> None:
        """Check the standard deviation."""
        require(self.sd > 0, "a standard deviation above 0")

    @property
    def support(self) -> tuple[SampleValue, ...]:
        """Return the numbers six standard deviations below and above the mean."""
        return self.mean - _MAX_STANDARD_DEVIATIONS * self.sd, self.mean + _MAX_STANDARD_DEVIATIONS * self.sd

    def quantile(self, probability: float) -> float:
        """Return the number below which a sample lies with a given probability between 0 and 1."""
        return self.mean + self.sd * min(
            max(float(ndtri(probability)), -_MAX_STANDARD_DEVIATIONS), _MAX_STANDARD_DEVIATIONS
        )

    def spec_value(self) -> SpecValue:
        """Return the TOML table with the key `normal`."""
        return {"normal": _float_list(self.mean, self.sd)}


@dataclass(frozen=True)
class TruncatedNormal(Distribution):
    """Normal distribution restricted to an interval and renormalised."""

    mean: float
    sd: float
    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the standard deviation and the limits."""
        require(self.sd > 0, "a standard deviation above 0")
        require(self.low < self.high, "a lower limit that is less than the upper limit")
        below, above = self._probabilities_at_limits
        require(
            above - below >= _MIN_INTERVAL_PROBABILITY,
            f"limits that contain at least {_MIN_INTERVAL_PROBABILITY:g} of the normal distribution",
        )

    @property
    def _probabilities_at_limits(self) -> tuple[float, float]:
        """Return the cumulative probabilities of the untruncated normal distribution at both limits.

        If both limits exceed the mean, they are mirrored about the mean and swapped, because the difference
        of two probabilities near 1 would lose precision.
        """
        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        return (float(ndtr(-high)), float(ndtr(-low))) if low > 0 else (float(ndtr(low)), float(ndtr(high)))

    @property
    def support(self) -> tuple[SampleValue, ...]:
        """Return the two limits."""
        return self.low, self.high

    def quantile(self, probability: float) -> float:
        """Return the number below which a sample lies with a given probability between 0 and 1."""
        below, above = self._probabilities_at_limits
        if self.low > self.mean:
            deviation = -float(ndtri(above - probability * (above - below)))
        else:
            deviation = float(ndtri(below + probability * (above - below)))
        return min(max(self.mean + self.sd * deviation, self.low), self.high)

    def spec_value(self) -> SpecValue:
        """Return the TOML table with the key `truncated`."""
        return {"truncated": _float_list(self.mean, self.sd, self.low, self.high)}


@dataclass(frozen=True)
class Choice(Distribution):
    """Weighted choice among distributions, usually constants; the weights need not sum to 1."""

    values: tuple[Distribution, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the values and the weights."""
        require(0 < len(self.values) <= _MAX_CHOICES, f"1 to {_MAX_CHOICES:,} values to choose from")
        require(len(self.weights) == len(self.values), f"as many weights as values ({len(self.values)})")
        require(min(self.weights) >= 0 and sum(self.weights) > 0, "weights from 0, at least one above 0")
        require(
            len({isinstance(bound, str) for value in self.values for bound in value.support}) <= 1,
            "either numbers or texts to choose from",
        )

    @property
    def support(self) -> tuple[SampleValue, ...]:
        """Return the smallest and the largest number, or all strings, of the alternatives."""
        bounds = [bound for value in self.values for bound in value.support]
        if isinstance(bounds[0], str):
            return tuple(dict.fromkeys(bounds))
        return min(bounds), max(bounds)

    def quantile(self, probability: float) -> SampleValue:
        """Return the sample that belongs to a probability between 0 and 1.

        The range from 0 to 1 is divided into one interval per alternative, with a length proportional to the
        weight of the alternative. The interval that contains `probability` selects an alternative. The
        relative position of `probability` in this interval is passed to the `quantile` of the alternative.
        """
        cumulative = list(accumulate(self.weights))
        position = probability * cumulative[-1]
        index = bisect_right(cumulative, position)
        while index >= len(cumulative) or not self.weights[index]:  # past the last one by rounding
            index -= 1
        fraction = (position - (cumulative[index] - self.weights[index])) / self.weights[index]
        return self.values[index].quantile(min(max(fraction, 2.0**-53), 1.0 - 2.0**-53))

    def spec_value(self) -> SpecValue:
        """Return the TOML table with the keys `choice` and `weights`."""
        return {"choice": [one.spec_value() for one in self.values], "weights": _float_list(*self.weights)}


@dataclass(frozen=True, repr=False)
class FileChoice(Distribution):
    """Choice among the files that match a pattern, with equal probability.

    pattern : file name pattern with wildcards, relative to the spec's folder
    names : sorted paths relative to the spec's folder; empty until the pattern is resolved
    """

    pattern: str
    names: tuple[str, ...] = ()

    @property
    def support(self) -> tuple[SampleValue, ...]:
        """Return the paths of all matching files."""
        return self.names

    def quantile(self, probability: float) -> str:
        """Return the path for a probability; each path has an interval of equal length between 0 and 1."""
        return self.names[min(int(probability * len(self.names)), len(self.names) - 1)]

    def spec_value(self) -> SpecValue:
        """Return the TOML table with the key `files`."""
        return {"files": self.pattern}

    def __repr__(self) -> str:
        """Return the TOML table as a string, which has the file name pattern but not the matching paths."""
        return repr(self.spec_value())


def _float_list(*numbers: float) -> list[float]:
    return list(map(float, numbers))


_MAX_SPEC_NUMBER = 1e9  # largest magnitude of a number in a spec
_EXPECTED_DISTRIBUTION_FORMS = (
    "a number, a text, or one of {uniform = [low, high]}, {log_uniform = [low, high]}, "
    "{normal = [mean, sd]}, {truncated = [mean, sd, low, high]}, {choice = [...], weights = [...]} "
    "and {files = PATTERN}"
)
_NUMERIC_DISTRIBUTIONS: Mapping[str, tuple[int, Callable[..., Distribution]]] = {
    "uniform": (2, Uniform),
    "log_uniform": (2, lambda low, high: Uniform(low, high, True)),
    "normal": (2, Normal),
    "truncated": (4, TruncatedNormal),
}


def parse_distribution(spec_value: object, is_nested: bool = False) -> Distribution:
    """Return the distribution that a TOML value of a spec describes.

    is_nested : whether the value is an alternative of a choice; an alternative must not itself be a
        choice or a file pattern

    Raises ValueError with a description of the valid values.
    """
    if isinstance(spec_value, Distribution):
        return spec_value
    if isinstance(spec_value, str):
        return Constant(spec_value)
    if _is_number(spec_value):
        return Constant(float(spec_value))
    table: Mapping[str, object] = spec_value if isinstance(spec_value, Mapping) else {}
    kind = next(iter(table), "")
    if kind in _NUMERIC_DISTRIBUTIONS and len(table) == 1:
        count, make = _NUMERIC_DISTRIBUTIONS[kind]
        return make(*_number_list(table[kind], f"{count} numbers in {kind}", count))
    if is_nested:
        raise ValueError(_EXPECTED_DISTRIBUTION_FORMS)
    if kind == "files" and len(table) == 1 and isinstance(table[kind], str):
        return FileChoice(str(table[kind]))
    if "choice" in table and table.keys() <= {"choice", "weights"}:
        values = table["choice"]
        if not isinstance(values, list | tuple):
            raise ValueError("a list in choice")
        weights = _number_list(table.get("weights", [1.0] * len(values)), "a list of numbers in weights")
        return Choice(tuple(parse_distribution(one, True) for one in values), tuple(weights))
    raise ValueError(_EXPECTED_DISTRIBUTION_FORMS)


def _number_list(spec_value: object, expected_text: str, number_count: int | None = None) -> list[float]:
    """Return the numbers in a list of a spec as floats.

    expected_text : description of the valid values, for the message
    number_count : required length of the list; None for any length

    Raises ValueError if the value is not a list of numbers, or has another length.
    """
    if not isinstance(spec_value, list | tuple) or number_count not in (None, len(spec_value)):
        raise ValueError(expected_text)
    numbers = [float(one) for one in spec_value if _is_number(one)]
    if len(numbers) != len(spec_value):
        raise ValueError(
            f"{expected_text}, none beyond {_MAX_SPEC_NUMBER:g}" if number_count else expected_text
        )
    return numbers


def _is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return isfinite(value) and abs(value) <= _MAX_SPEC_NUMBER
