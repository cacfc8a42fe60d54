"""Render gallery pictures and store them as WebP for the documentation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from dermis.apps.gallery.panels import panel_sheet
from dermis.apps.gallery.script import encode_webp, find_scripts
from dermis.apps.gallery.studio import Studio
from dermis.base.command_line import run_script

FOLDER = Path(__file__).parent.parent / "docs" / "images"
WIDEST = 1600


def main(*names: str) -> None:
    """Render all pictures, or those with the given names."""
    studio = Studio("lee_perry_smith")
    for script in find_scripts(names):
        picture = Image.fromarray(panel_sheet(script.draw(studio), script.columns))
        picture.thumbnail((WIDEST, 4 * WIDEST), Image.Resampling.LANCZOS)
        (FOLDER / f"{script.name}.webp").write_bytes(encode_webp(np.asarray(picture)))


if __name__ == "__main__":
    run_script(main)
