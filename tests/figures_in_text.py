"""Comparison of texts that contain computed figures: words exactly, figures within their tolerance.

The last printed digit of a computed figure depends on the processor, so no test compares such text by
equality.
"""

from __future__ import annotations

import re
from itertools import zip_longest
from typing import NamedTuple

from tolerances import PRINTED

_FIGURE = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w]|\.\d)")
_COUNT = re.compile(r"\d+")


class _Figure(NamedTuple):
    value: float
    unit: float
    """Value of one in the last printed digit; 0 for a count, which is exact."""


def differences(found: str, expected: str) -> list[str]:
    """Return the lines that differ, each with the found and the expected line.

    Words, spaces and integers are compared exactly. Numbers with decimals or an exponent and percentages may
    differ by one in the last digit of the one with fewer decimals, and by the relative tolerance PRINTED.
    """
    lines = zip_longest(found.splitlines(), expected.splitlines())
    return [f"found    {one}\nexpected {other}" for one, other in lines if not _same(one, other)]


def _same(one: str | None, other: str | None) -> bool:
    if one is None or other is None or _FIGURE.sub("#", one) != _FIGURE.sub("#", other):
        return one == other
    pairs = zip(_figures(one), _figures(other), strict=True)
    return all(abs(a.value - b.value) <= _allowed(a, b) for a, b in pairs)


def _figures(line: str) -> list[_Figure]:
    return [
        _Figure(float(found[0]), _unit(found[0], line[found.end() :])) for found in _FIGURE.finditer(line)
    ]


def _unit(text: str, after: str) -> float:
    if _COUNT.fullmatch(text) and not after.lstrip().startswith("%"):
        return 0.0
    digits, _, power = text.partition("e")
    return float(10.0 ** (int(power or 0) - len(digits.partition(".")[2])))


def _allowed(one: _Figure, other: _Figure) -> float:
    if one.unit == other.unit == 0.0:
        return 0.0
    return 1.001 * max(one.unit, other.unit) + PRINTED * max(abs(one.value), abs(other.value))
