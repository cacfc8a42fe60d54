"""Options of all commands refuse invalid numbers and numbers out of range."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from cyclopts import App

from dermis.base.console import print_json
from dermis.cli import COMMANDS

Run = Callable[..., Any]
SUBJECTS = {"render": ["head.obj"], "animate": ["head.obj"], "view": ["head.obj"]}
SUBJECTS |= {"profile": ["skin1"], "compare": ["head.obj"]}
NOT_NUMBERS = ("nan", "-1e308", "9" * 5000)
IN_WORDS = {
    "--pose": "jawOpen={}",
    "--bone": "head=0,0,{}",
    "--look-at": "0,0,{}",
    "--eye": "pupil_mm={}",
    "--target": "nose/nose-hump-incr={}",
    "--expression": "jawOpen={}",
    "--skin": "seed={}",
    "--hair": "length_mm={}",
    "--through": "1,{}",
    "--fps": "{}",
    "--background": "0,0,{}",
}
"""Options of text that holds numbers."""


def _options() -> Iterator[tuple[str, str, str]]:
    """Yield command, option and number format; scene options only once."""
    seen = set()
    for command in COMMANDS:
        app = App(name=command)
        app.default(getattr(import_module(f"dermis.cli.{command}"), command))
        for argument in app.assemble_argument_collection():
            option, kinds = argument.names[0], {argument.hint, *get_args(argument.hint)}
            form = IN_WORDS.get(option) if kinds & {str, list[str]} else None
            if kinds & {int, float}:
                form = {2: "{}x32", 3: "0,0,{}"}.get(
                    len(get_args(argument.hint)) * (tuple in _origins(argument)), "{}"
                )
            if form is not None and (option, str(argument.hint)) not in seen:
                seen.add((option, str(argument.hint)))
                yield command, option, form


def _origins(argument: Any) -> tuple[Any, ...]:
    return (getattr(argument.hint, "__origin__", None),)


OPTIONS = sorted(set(_options()))


def test_all_options_of_numbers_are_tried() -> None:
    names = {option for _, option, _ in OPTIONS}
    assert names >= {
        "--size",
        "--height-mm",
        "--exposure",
        "--seam-colour",
        "--from",
        "--crf",
        "--port",
        *IN_WORDS,
    }


@pytest.mark.parametrize(("command", "option", "form"), OPTIONS, ids=[" ".join(one[:2]) for one in OPTIONS])
def test_text_instead_of_a_number_is_refused(
    run: Run, folder: Path, command: str, option: str, form: str
) -> None:
    number = NOT_NUMBERS[len(option) % len(NOT_NUMBERS)]  # each takes its turn
    ended = run(command, *SUBJECTS.get(command, []), f"{option}={form.format(number)}")
    assert (ended.code, ended.stdout) == (2, "")
    assert "expected" in ended.stderr and len(ended.stderr) < 2000
    assert [file.name for file in folder.iterdir()] == ["head.obj"]


def test_json_contains_no_nan_or_infinity(capfd: pytest.CaptureFixture[str]) -> None:
    numbers = {"a": float("nan"), "b": [np.float64("inf"), 1.5], "c": ({"d": -float("inf")},)}
    print_json(numbers)
    assert json.loads(capfd.readouterr().out) == {"a": None, "b": [None, 1.5], "c": [{"d": None}]}
