"""Every gallery script runs; small, since only the documentation needs its picture large."""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest

from dermis.images.io import read_image
from dermis.rendering.renderer import Renderer
from dermis.scene.settings import Settings

SCRIPTS = sorted((Path(__file__).parent.parent / "gallery").glob("[0-9]*.py"))
HEADS = {"17_seams": ["bust"]}  # which 07_bust has made; the one in many charts takes as long again
SMALL = {"size": (48, 48), "atlas": 128, "samples": 1, "shadow_size": 256}


def test_there_are_scripts() -> None:
    assert len(SCRIPTS) >= 4


@pytest.mark.samples
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Renderer.draw

    def small(self: Renderer, scene: Any, settings: Settings, **options: Any) -> Any:
        return whole(self, scene, settings.model_copy(update=SMALL), **options)

    output = tmp_path / "picture.png"
    makehuman = Path(os.environ["DERMIS_DATA"]) / "heads" / "makehuman"
    folder = [str(makehuman)] if "MAKEHUMAN_FOLDER" in script.read_text(encoding="utf-8") else []
    heads = folder or HEADS.get(script.stem, [])
    monkeypatch.setattr(Renderer, "draw", small)
    monkeypatch.setattr(sys, "argv", [str(script), str(output), *heads])
    runpy.run_path(str(script), run_name="__main__")
    picture = read_image(output)
    assert picture.max() > 60
    assert len(script.read_text(encoding="utf-8").splitlines()) <= 40
