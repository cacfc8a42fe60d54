"""Comparison of texts with figures: rounding differences pass, all others fail."""

from __future__ import annotations

import pytest
from figures_in_text import differences

LINE = "| Cycles 4.5 | skin1 | 0.056 / -0.080 | 9.95 % | 27674 |"


@pytest.mark.parametrize(
    "text",
    [
        LINE,
        LINE.replace("0.056", "0.057"),
        LINE.replace("-0.080", "-0.079"),
        LINE.replace("9.95 %", "10.0 %"),
    ],
)
def test_rounded_numbers_match(text: str) -> None:
    assert differences(text, LINE) == differences(LINE, text) == []


@pytest.mark.parametrize(
    "text",
    [
        LINE.replace("0.056", "0.058"),
        LINE.replace("-0.080", "0.080"),
        LINE.replace("9.95 %", "12 %"),
        LINE.replace("27674", "27675"),
        LINE.replace("Cycles", "Blender"),
        LINE.replace("skin1", "skin2"),
        LINE.replace(" / ", " "),
        LINE.replace("0.056", "-"),
        f"{LINE}\n\n",
        f"{LINE} 0.056",
        "",
    ],
)
def test_other_differences_are_detected(text: str) -> None:
    assert differences(text, LINE) and differences(LINE, text)


def test_each_line_that_differs_is_shown() -> None:
    found = differences("a 1.0\nb 2.0\nc 3.0", "a 1.1\nb 2.5\nc 3")
    assert found == ["found    b 2.0\nexpected b 2.5"]


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("1.2345678901", "1.2345670000", True),  # PRINTED of the value
        ("1.23456", "1.23468", False),
        ("2.50e-3", "2.51e-3", True),
        ("2.50e-3", "2.53e-3", False),
        ("9.99", "10", True),
        ("9.99", "12", False),
        ("12 %", "13 %", True),
        ("12", "13", False),
        ("1.1.1", "1.1.2", False),  # a version
    ],
)
def test_one_unit_in_the_last_digit_is_accepted(one: str, other: str, same: bool) -> None:
    assert (differences(one, other) == []) is same
