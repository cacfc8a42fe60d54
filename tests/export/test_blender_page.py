"""What docs/engines.md says of Blender is what was measured, and that is within what was promised."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_tables_are_those_of_the_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(ROOT / "benchmarks"), *sys.path])
    from engines_blender_table import tables

    page = (ROOT / "docs" / "engines.md").read_text("utf-8")
    for line in filter(None, tables().splitlines()):
        assert line in page, "python benchmarks/engines_blender_table.py prints the tables"
