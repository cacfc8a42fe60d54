"""Page about path-traced people: its rows, its picture and its text."""

from __future__ import annotations

import io
import string
from pathlib import Path

import numpy as np
from PIL import Image

from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.accuracy import person as page
from dermis.apps.validation.comparisons.person import PersonComparison

ROOT = Path(__file__).parents[2]
ONE = Estimate(1.0, 0.01)


def noisy(name: str, side: int) -> PersonComparison:
    """Return a comparison whose pictures are noise, which compresses worst."""
    rng = np.random.default_rng(len(name))
    image, mask = rng.random((side, side, 3)), np.ones((side, side), bool)
    return PersonComparison(name, image, image, 0 * image, mask, ONE, ONE, (ONE,) * 3, 40, 12.0)


def measured(
    view: str, skin_kind: page.SharedSkinKind = "matched", omitted_feature: page.OmittedFeature | None = None
) -> page.ComparisonResult:
    """Return figures of one comparison, keyed as in the file of results."""
    figures = page.comparison_result(noisy(view, 8))
    figures |= {"regions": {"ear": [0.9, 0.01]}, "default": [0.3, 0.01, 0.8, 0.01]}
    return {page.ComparisonCase("human", view, skin_kind, omitted_feature).key: figures}


def test_row_states_view_light_and_errors() -> None:
    line = page.view_rows(measured("eye") | measured("eye", "layered")).splitlines()[3]
    expected = "| eye | window | 40 | 1.000 ± 0.010 | 1.000 | not measured |  | 1.000 ± 0.010 | 1.000 | "
    assert line == f"{expected}0.300 ± 0.010 | 0.800 |"


def test_tables_state_regions_and_causes() -> None:
    assert "| ear | 0.90 |" in page.region_table(measured("profile"))
    causes = page.omitted_feature_table(measured("portrait", omitted_feature="relief")).splitlines()
    assert causes[2].startswith("| nothing | not measured")
    assert any(line.startswith("| relief | 1.000 ± 0.010 | 1.000 |") for line in causes)


def test_all_comparisons_have_keys_of_their_own() -> None:
    keys = [one.key for one in page.list_comparison_cases()]
    assert len(set(keys)) == len(keys)


def test_the_picture_is_small_and_shows_all_views() -> None:
    for view in page.ALL_VIEWS:
        page.save_panels(view, noisy(view, 96))
    data = page.picture_sheet(list(page.ALL_VIEWS))
    assert len(data) <= page.MAX_SHEET_BYTES
    width, height = Image.open(io.BytesIO(data)).size
    rows = -(-len(page.ALL_VIEWS) // page.SHEET_COLUMNS)
    assert width >= page.SHEET_COLUMNS * 3 * 96 and height >= rows * 96


def test_page_lists_its_placeholders() -> None:
    text = (ROOT / "docs" / "templates" / "path_traced.md").read_text(encoding="utf-8")
    names = {name for _, name, _, _ in string.Formatter().parse(text) if name}
    assert {"views", "people", "heads", "regions", "causes", "right", "down", "side", "adapter"} <= names
    assert "{views}" not in (ROOT / "docs" / "path_traced.md").read_text(encoding="utf-8")
