"""Draws the pictures of a gallery one after another, as WebP files."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dermis.apps.gallery.picture import as_bytes, still
from dermis.apps.gallery.script import Panel, Script
from dermis.apps.gallery.studio import Studio
from dermis.base.atomic_write import replacing
from dermis.base.errors import DermisError

_QUALITY, _FILM_MS = 86, 80


@dataclass(frozen=True)
class Picture:
    """The result of a script.

    panels : WebP files by caption
    size : width and height of the first one [pixel]
    seconds : that the script took
    frame_ms : median of its frames [ms]; None if it drew none
    fault : why there is no picture
    """

    script: Script
    panels: dict[str, bytes]
    size: tuple[int, int]
    seconds: float
    frame_ms: float | None
    fault: str = ""


def draw_pictures(scripts: Sequence[Script], studio: Studio) -> Iterator[Picture]:
    """Each script's picture; a script that fails for lack of something gives a picture that says so."""
    for script in scripts:
        started, studio.frames_ms = time.perf_counter(), []
        try:
            drawn = script.draw(studio)
        except DermisError as fault:
            yield Picture(script, {}, (0, 0), time.perf_counter() - started, None, str(fault))
            continue
        height, width = still(next(iter(drawn.values()))).shape[:2]
        panels = {caption: encode_webp(panel) for caption, panel in drawn.items()}
        frame_ms = float(np.median(studio.frames_ms)) if studio.frames_ms else None
        yield Picture(script, panels, (width, height), time.perf_counter() - started, frame_ms)


def encode_webp(panel: Panel, quality: int = _QUALITY) -> bytes:
    """A panel as a WebP file, animated if it is a film."""
    from PIL import Image as Pillow

    images = panel if isinstance(panel, list) else [panel]
    first, *others = (Pillow.fromarray(as_bytes(image)) for image in images)
    file = io.BytesIO()
    film: dict[str, Any] = {"save_all": True, "append_images": others, "duration": _FILM_MS, "loop": 0}
    first.save(file, "webp", quality=quality, method=4, **(film if others else {}))
    return file.getvalue()


def write_panels(folder: Path, picture: Picture) -> None:
    """Write a picture's panels as separate files.

    Raises DermisError when that is not possible.
    """
    for number, file in enumerate(picture.panels.values(), 1):
        with replacing(folder / f"{picture.script.name}-{number}.webp") as trial:
            trial.write_bytes(file)
