"""Only tests of listed modules, each with a reason, run a second time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rerun_modules import RERUN

TESTS = Path(__file__).parent
OTHERWISE = re.compile(r"\b(flaky|reruns?(_delay)?|only_rerun)\b")


def test_listed_modules_exist_and_have_a_reason() -> None:
    modules = {path.stem for path in TESTS.rglob("test_*.py")}
    assert set(RERUN) <= modules
    assert all(len(reason.split()) > 5 for reason in RERUN.values())


def test_other_modules_are_not_rerun(request: pytest.FixtureRequest) -> None:
    marked = {
        path.stem
        for path in TESTS.rglob("*.py")
        if path != Path(__file__) and OTHERWISE.search(path.read_text("utf-8"))
    }
    assert marked == {"conftest"}
    assert not request.config.getoption("reruns", None)


def test_only_listed_modules_are_marked(request: pytest.FixtureRequest) -> None:
    for item in request.session.items:
        assert (item.get_closest_marker("flaky") is not None) is (item.path.stem in RERUN)
