"""Page about path-traced people: its rows, its picture and its text."""

from __future__ import annotations

import io
import string
from pathlib import Path

import numpy as np
from PIL import Image

from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.accuracy import person as page
from dermis.apps.validation.comparisons.person import VIEWS, PersonComparison

ROOT = Path(__file__).parents[2]
ONE = Estimate(1.0, 0.01)


def noisy(name: str, side: int) -> PersonComparison:
    """Return a comparison whose pictures are noise, which compresses worst."""
    rng = np.random.default_rng(len(name))
    image, mask = rng.random((side, side, 3)), np.ones((side, side), bool)
    return PersonComparison(name, image, image, 0 * image, mask, ONE, ONE, (ONE,) * 3, 40, 12.0)


def test_row_states_view_light_and_errors() -> None:
    line = page.view_row(noisy("eye", 8))
    assert line == "| eye | window | 40 | 1.000 ± 0.010 | 1.000 ± 0.010 | 1.00, 1.00, 1.00 |"


def test_the_picture_is_small_and_shows_all_views() -> None:
    data = page.picture_sheet([noisy(name, 96) for name in VIEWS])
    assert len(data) <= page.MAX_SHEET_BYTES
    width, height = Image.open(io.BytesIO(data)).size
    assert width >= page.SHEET_COLUMNS * 96 and height >= -(-2 * len(VIEWS) // page.SHEET_COLUMNS) * 96


def test_page_lists_its_placeholders() -> None:
    text = (ROOT / "docs" / "templates" / "path_traced.md").read_text(encoding="utf-8")
    names = {name for _, name, _, _ in string.Formatter().parse(text) if name}
    assert {"rows", "right", "down", "brightness", "left_half", "right_half", "side", "adapter"} <= names
    assert "{rows}" not in (ROOT / "docs" / "path_traced.md").read_text(encoding="utf-8")
