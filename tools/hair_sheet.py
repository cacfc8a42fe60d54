"""Render a contact sheet for each hair style and beard: three textures, two tones and two lights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import dermis
from dermis.base.command_line import run_script
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import BEARD_STYLES, HAIR_STYLES
from dermis.human.hair.styles import styles as style_table
from dermis.scene import Scene, Settings, load_lights
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS

TEXTURES = {"straight": 0.0, "wavy": 0.35, "coiled": 0.9}
"""Values of `HairLook.curl` by name of a hair texture."""
TONES = {"dark": (5.0, 0.3), "blond": (0.35, 0.4)}
"""Eumelanin and pheomelanin by name of a hair colour."""
RIGS = "studio", "rim"
ALL_STYLES = (*HAIR_STYLES[1:], *(f"beard-{name}" for name in BEARD_STYLES[1:]))
SIDE_VIEW_STYLES = "ponytail", "bun", "cornrows"
_ANCESTRIES = "african", "asian", "caucasian"
_ANCESTRY_BY_TEXTURE = {"straight": "asian", "wavy": "caucasian", "coiled": "african"}


def picture_column(
    renderer: Renderer, look: dermis.HairLook, texture: str, camera: str, side: int
) -> NDArray[np.uint8]:
    """Render a person in all lights, and return the pictures (n, side, 3), one above the other.

    look : hair of the person
    texture : name of the hair's texture, which selects the ancestry
    camera : name of a camera preset
    side : width and height of a picture [pixel]
    """
    african, asian, caucasian = (float(_ANCESTRY_BY_TEXTURE[texture] == name) for name in _ANCESTRIES)
    style = style_table().get(look.style)
    man = look.beard_mm > 0.0 or style is None or style.men > style.women
    head = dermis.Human(
        african=african, asian=asian, caucasian=caucasian, sex=float(man), age=30.0, hair=look
    ).head()
    settings = Settings(size=(side, side), atlas=1024, **PHOTOGRAPHIC_SETTINGS)
    view = dermis.side(head) if camera == "side" else dermis.three_quarter(head)
    scenes = (Scene(head, camera=view, lights=load_lights(rig)) for rig in RIGS)
    return np.concatenate([renderer.draw(scene, settings).srgb8() for scene in scenes])


def main(
    output: Path,
    *,
    side: int = 450,
    styles: str = "",
    textures: str = "",
    tones: str = "",
    adapter: str = "auto",
) -> None:
    """Write a sheet for each style, with a column for each texture and tone, and a row for each light.

    Parameters
    ----------
    output:
        Folder in which the sheets are written as WebP.
    side:
        Side of each picture [pixel].
    styles:
        Names of hair styles, or "beard-" and the name of a beard style, separated by commas; all by default.
    textures:
        Names of textures, separated by commas; all by default.
    tones:
        Names of tones, separated by commas; all by default.
    adapter:
        Adapter that renders the pictures.
    """
    output.mkdir(parents=True, exist_ok=True)
    renderer = Renderer(adapter)
    for name in styles.split(",") if styles else ALL_STYLES:
        columns = []
        for texture in textures.split(",") if textures else TEXTURES:
            for tone in tones.split(",") if tones else TONES:
                is_hair, (eumelanin, pheomelanin) = name in HAIR_STYLES, TONES[tone]
                look = dermis.HairLook(
                    style=name if is_hair else "short",
                    beard_style="none" if is_hair else name.removeprefix("beard-"),
                    curl=TEXTURES[texture],
                    eumelanin=eumelanin,
                    pheomelanin=pheomelanin,
                )
                camera = "side" if name in SIDE_VIEW_STYLES else "three-quarter"
                columns.append(picture_column(renderer, look, texture, camera, side))
        sheet = Image.fromarray(np.concatenate(columns, axis=1))
        sheet.save(output / f"{name}.webp", quality=85)


if __name__ == "__main__":
    run_script(main)
