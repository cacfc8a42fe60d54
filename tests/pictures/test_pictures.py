"""Whole frames against stored pictures: what no other test names is not to change unseen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pictured import STORED, drawn, pictured
from tolerances import PICTURE_MEAN, PICTURE_TAIL

from dermis.frame.renderer import Renderer
from dermis.images.io import read_image, write_png

pytestmark = pytest.mark.usefixtures("many_form_factor_lines")

NAMES = ("studio", "dry", "window", "ear")


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    opened = Renderer("cpu")
    if opened.device.adapter.kind != "CPU":
        pytest.skip("pictures are stored from a software adapter")
    return opened


@pytest.mark.parametrize("name", NAMES)
def test_picture_matches_reference(name: str, renderer: Renderer, tmp_path: Path) -> None:
    scene, chosen = next((scene, chosen) for known, scene, chosen in pictured() if known == name)
    image = drawn(renderer, scene, chosen).astype(int)
    stored = read_image(STORED / f"{name}.png").astype(int)
    difference = np.abs(image - stored)
    mean, tail = difference.mean(), np.percentile(difference, 99.5)
    if mean > PICTURE_MEAN or tail > PICTURE_TAIL:
        place = tmp_path / f"{name}.png"
        shown = np.hstack([image, stored, np.minimum(8 * difference, 255)])
        write_png(place, shown.astype(np.uint8))
        pytest.fail(
            f"mean difference {mean:.2f}, 99.5 % of it under {tail:.0f}; {place} shows picture, stored one "
            "and 8 times their difference. If it is meant to be so, run tests/pictures/pictured.py"
        )


def test_all_reference_pictures_are_tested() -> None:
    assert tuple(name for name, _, _ in pictured()) == NAMES
    assert {path.stem for path in STORED.glob("*.png")} == set(NAMES)
