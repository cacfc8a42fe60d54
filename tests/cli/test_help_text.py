"""Help fits terminals of any width, without the line breaks of the source."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

from dermis.base.command_line import reflow
from dermis.cli import COMMANDS

Run = Callable[..., Any]


def test_paragraphs_become_lines_and_the_rest_stays() -> None:
    text = """Do this.

    A long
    paragraph.

    Examples:

        dermis one

        dermis two

    Parameters
    ----------
    name:
        First
        and second.
    other:
        Third.
    """
    assert reflow(text).splitlines() == [
        "Do this.", "", "A long paragraph.", "", "Examples:", "", "    dermis one", "", "    dermis two", "",
        "Parameters", "----------", "name:", "    First and second.", "other:", "    Third.",
    ]  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_help_wraps_at_the_terminals_width(run: Run, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    told = {}
    for columns in (60, 100, 240):
        monkeypatch.setenv("COLUMNS", str(columns))
        ended = run(name, "--help")
        lines = ended.stdout.splitlines()
        assert ended.code == 0
        boxed = [line for line in lines if line.startswith(("│", "╭", "╰"))]
        assert boxed and max(map(len, boxed)) <= columns
        told[columns] = " ".join(re.sub(r"[│╭╮╰╯─]", " ", ended.stdout).split())
        starts = [line for line in boxed if re.match(r"│ (\* )? *[A-Z-]", line)]
    assert len(starts) > 0.7 * len([line for line in boxed if line.startswith("│")])  # few lines go on at 240
    assert len(told[60].split()) >= len(told[240].split())
