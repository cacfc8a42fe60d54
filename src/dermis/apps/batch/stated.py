"""Reading distributions from what a spec states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any

from dermis.apps.batch.distributions import Choice, Constant, Distribution, Files, Normal, Truncated, Uniform

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


def stated(told: Any, deep: bool = False) -> Distribution:
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
    return Choice(tuple(stated(value, True) for value in values), tuple(map(float, weights)))


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and isfinite(value)
        and abs(value) <= _MOST
    )
