"""Render contact sheets of garments, glasses and headwear: each on four people in two lights."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import dermis
from dermis.base.command_line import run_script
from dermis.frame.renderer import Renderer
from dermis.human.wear.look import GARMENT_NAMES, GLASSES_STYLES, HEADWEAR_STYLES
from dermis.scene import Scene, Settings, load_lights
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS

RIGS = "studio", "rim"
ITEMS = {"clothing": GARMENT_NAMES, "glasses": GLASSES_STYLES, "headwear": HEADWEAR_STYLES}
"""Names of items by field of `Human`."""
_COLOURS = {
    "clothing": ("navy", "cream", "burgundy", "olive"),
    "headwear": ("charcoal", "mustard", "teal", "red"),
}


def main(
    output: Path, *, side: int = 192, seeds: str = "2,3,4,11", items: str = "", adapter: str = "auto"
) -> None:
    """Write a sheet for each kind of item, with a row for each item and two columns for each person.

    Parameters
    ----------
    output:
        Folder in which the sheets are written as PNG.
    side:
        Side of each picture [pixel].
    seeds:
        Seeds of the people, separated by commas.
    items:
        Fields of `Human`, such as headwear, separated by commas; all by default.
    adapter:
        Adapter that renders the pictures.
    """
    output.mkdir(parents=True, exist_ok=True)
    renderer = Renderer(adapter)
    settings = Settings(size=(side, side), atlas=512, **PHOTOGRAPHIC_SETTINGS)
    for field in items.split(",") if items else ITEMS:
        rows = []
        for name in ITEMS[field]:
            pictures = []
            for place, seed in enumerate(seeds.split(",")):
                colours = _COLOURS.get(field)
                words = name if colours is None else f"{colours[place % len(colours)]} {name}"
                worn: dict[str, Any] = {"clothing": "grey crew neck", field: words}
                head = replace(dermis.Human.sampled(int(seed)), **worn).head()
                camera = dermis.three_quarter(head)
                scenes = (Scene(head, camera=camera, lights=load_lights(rig, head)) for rig in RIGS)
                pictures += [renderer.draw(scene, settings).srgb8() for scene in scenes]
            rows.append(np.concatenate(pictures, axis=1))
        Image.fromarray(np.concatenate(rows)).save(output / f"{field}.png")


if __name__ == "__main__":
    run_script(main)
