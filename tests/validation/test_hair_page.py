"""Page about hair: its rows, and the continuation of an interrupted measurement."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.accuracy import hair as page
from dermis.apps.validation.comparisons.person import PersonComparison
from dermis.frame.renderer import Renderer

SIDE = 16


def comparison(name: str) -> PersonComparison:
    """Return a comparison of grey pictures, with an error of 0.1 and an energy of 0.97."""
    image, mask = np.full((SIDE, SIDE, 3), 0.5), np.ones((SIDE, SIDE), bool)
    error, energy = Estimate(0.1, 0.02), Estimate(0.97, 0.01)
    return PersonComparison(name, image, image, 0 * image, mask, error, energy, (energy,) * 3, 64, 1.0)


def test_rows_have_as_many_cells_with_and_without_measurements() -> None:
    one = page.HairCase("short", "dark")
    figures = {one.key: page.hair_result(comparison(one.key))}
    rows = page.case_rows(figures).splitlines()
    assert rows[0].startswith("| dark | 0.100 ± 0.020 | 0.970 | not measured |  |")
    details = page.detail_rows({"short / 64": [0.3, 0.9]}).splitlines()
    assert details[0].startswith("| short | 0.300 | 0.900 | not measured |  |")
    for lines, cells in ((rows, 1 + 2 * len(page.STYLES)), (details, 1 + 2 * len(page.LOD_SIDES))):
        assert {line.count("|") for line in lines} == {cells + 1}
    assert page.cost_rows({"short / 0.25": None}).startswith("| short | not measured |")


def test_summary_counts_cases_that_reach_the_goals_despite_noise() -> None:
    good, noisy = page.hair_result(comparison("a")), page.hair_result(comparison("b")) | {"error": [0.0, 0.9]}
    assert "Of 2 measured cases, 2 have" in page.summary_text({"a": good, "b": noisy})
    assert "and 1 a relative RMSE" in page.summary_text({"a": good, "b": noisy})


def test_continued_measurement_shows_earlier_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measured: list[str] = []

    def measure(renderer: Renderer, case: page.HairCase, *settings: Any) -> PersonComparison:
        measured.append(case.key)
        if len(measured) == 3:
            raise KeyboardInterrupt
        return comparison(case.key)

    (tmp_path / "templates").mkdir()
    (tmp_path / "templates" / "hair.md").write_text("{cases}{costs}{details}", encoding="utf-8")
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path / "cache"))
    for name, file in (("PAGE", "hair.md"), ("PICTURE_FILE", "hair.webp"), ("RESULTS_FILE", "hair.json")):
        monkeypatch.setattr(page, name, tmp_path / file)
    for name, measurement in (
        ("compare_hair", measure),
        ("density_costs", lambda renderer: {}),
        ("detail_errors", lambda renderer: {}),
    ):
        monkeypatch.setattr(page, name, measurement)
    options: dict[str, Any] = {"size": SIDE, "paths": 64, "variant": "scalar_rgb"}
    with pytest.raises(KeyboardInterrupt):
        page.write_hair_page(**options)
    page.write_hair_page(**options)
    assert sorted(set(measured)) == sorted(one.key for one in page.list_hair_cases())
    assert len(measured) == len(page.list_hair_cases()) + 1
    _, height = Image.open(io.BytesIO((tmp_path / "hair.webp").read_bytes())).size
    assert height >= SIDE * -(-len(page.list_hair_cases()) // 2)
    assert "not measured |" in (tmp_path / "hair.md").read_text(encoding="utf-8")
