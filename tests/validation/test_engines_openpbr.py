"""Table of OpenPBR and pbrt: the page contains the stored results, and these are those computed now."""

from __future__ import annotations

import json

import pytest

from dermis.apps.validation.engines import openpbr as script
from dermis.apps.validation.engines.openpbr import RESULTS_FILE
from dermis.apps.validation.engines.page import PAGE

CHANGED = 2e-3  # change of an edge response


def test_page_contains_the_figures() -> None:
    figures = json.loads(RESULTS_FILE.read_text("utf-8"))
    assert figures["libraries"]["valid"] and figures["libraries"]["errors"] == []
    page = PAGE.read_text("utf-8")
    assert all(line in page for line in script.error_table(figures["skins"]))


def test_figures_match_recomputed_values(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(script, "COMPARED_SKINS", ("skin1",))
    known = json.loads(RESULTS_FILE.read_text("utf-8"))["skins"]["skin1"]
    found = script.skin_errors()["skin1"]
    for target, reading in (("openpbr", "error"), ("openpbr", "as_a_profile"), ("pbrt", "error")):
        edges = found[target][reading]["edge"]
        assert edges == pytest.approx(known[target][reading]["edge"], abs=CHANGED)
