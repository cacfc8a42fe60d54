"""The page of engines says what the targets say."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from figures_in_text import differences

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "engines.md"


@pytest.mark.skipif(not PAGE.is_file(), reason="this is no checkout")
def test_the_table_is_what_the_command_writes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path, str(ROOT / "benchmarks")])
    from engines_page import page

    assert differences(page(PAGE.read_text("utf-8")), PAGE.read_text("utf-8")) == []
