"""The page of engines contains what the export targets predict."""

from __future__ import annotations

import pytest
from figures_in_text import differences

from dermis.apps.validation.engines.page import PAGE, blender_tables, fill_tables


@pytest.mark.skipif(not PAGE.is_file(), reason="this is no checkout")
def test_table_equals_the_command_output() -> None:
    assert differences(fill_tables(PAGE.read_text("utf-8")), PAGE.read_text("utf-8")) == []


@pytest.mark.skipif(not PAGE.is_file(), reason="this is no checkout")
def test_blender_tables_equal_the_measurement() -> None:
    page = PAGE.read_text("utf-8")
    assert [line for line in filter(None, blender_tables().splitlines()) if line not in page] == []
