"""The page about unmixing agrees with the measurements."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from figures_in_text import differences

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


def test_the_page_matches_the_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path, str(FOLDER)])
    from unmixing_page import PAGE, figures, page

    told, widths = figures()
    text = page(told, widths)
    assert differences(text, PAGE.read_text("utf-8")) == [] and "<!--" not in text
    assert f"| {told['known']['0.05'][0]['skins']} |" in text
