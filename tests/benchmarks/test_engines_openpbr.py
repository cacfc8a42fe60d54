"""The table of OpenPBR and pbrt: the page has what the figures say, and the figures what is computed now."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE, FIGURES = ROOT / "docs" / "engines.md", ROOT / "benchmarks" / "results" / "engines_openpbr.json"
CHANGED = 2e-3  # of an edge


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import engines_openpbr

    yield engines_openpbr
    sys.modules.pop("engines_openpbr")


def test_the_page_has_the_figures(script: object) -> None:
    figures = json.loads(FIGURES.read_text("utf-8"))
    assert figures["libraries"]["valid"] and figures["libraries"]["errors"] == []
    page = PAGE.read_text("utf-8")
    assert all(line in page for line in script.table(figures["skins"]))  # type: ignore[attr-defined]


def test_figures_are_those_of_today(script: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(script, "SKINS", ("skin1",))
    known = json.loads(FIGURES.read_text("utf-8"))["skins"]["skin1"]
    found = script.figures()["skin1"]  # type: ignore[attr-defined]
    for target, reading in (("openpbr", "error"), ("openpbr", "as_a_profile"), ("pbrt", "error")):
        edges = found[target][reading]["edge"]
        assert edges == pytest.approx(known[target][reading]["edge"], abs=CHANGED)
