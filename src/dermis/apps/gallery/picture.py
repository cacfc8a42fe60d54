"""Panels side by side, with captions below, as one picture."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.gallery.script import Image, Panel, Panels, read_script
from dermis.apps.gallery.studio import Studio
from dermis.base.extras import needed
from dermis.images.colour import encode_srgb8

Bytes = NDArray[np.uint8]
_INCHES = 4.4
_BAR, _TEXT, _INK, _PAPER = 24, 14, (200, 200, 206), (22, 22, 26)


def as_bytes(image: Image) -> Bytes:
    """sRGB bytes of an image; floats are taken for linear light."""
    if image.dtype == np.uint8:
        return np.asarray(image, np.uint8)
    return encode_srgb8(np.maximum(image, 0.0).astype(np.float32))


def still(panel: Panel) -> Image:
    """A panel, or the first frame of a film."""
    return panel[0] if isinstance(panel, list) else panel


def sheet(panels: Panels, columns: int = 0) -> Bytes:
    """(h, w, 3) sRGB bytes of all panels in rows with captions below; films show their first frame.

    columns : panels in a row; 0 puts all of them in one
    """
    cells = [_cell(as_bytes(still(panel)), name) for name, panel in panels.items()]
    step = columns or len(cells)
    rows = [_beside(cells[start : start + step]) for start in range(0, len(cells), step)]
    width = max(row.shape[1] for row in rows)
    return np.vstack([_padded(row, row.shape[0], width) for row in rows])


def main(draw: Callable[[Studio], Panels]) -> None:
    """Draw the running script's picture: python gallery/NN_name.py OUTPUT [HEAD]."""
    from dermis.images.io import write_png

    output, head = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None
    with needed("matplotlib.style", "the gallery").context("dark_background"):
        panels = draw(Studio(head))
    write_png(output, sheet(panels, read_script(Path(sys.argv[0])).columns))


def plotted(plot: Callable[[Any], Any], side: int = 448) -> Bytes:
    """sRGB bytes of a square figure.

    plot : draws into matplotlib axes
    side : of the picture [pixel]
    """
    canvases = needed("matplotlib.backends.backend_agg", "the gallery")
    figure = needed("matplotlib.figure", "the gallery").Figure(
        figsize=(_INCHES, _INCHES), dpi=side / _INCHES, facecolor="#141417", layout="constrained"
    )
    plot(figure.subplots())
    canvas: Any = canvases.FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba(), np.uint8)[..., :3]


def _cell(image: Bytes, caption: str) -> Bytes:
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    bar = Pillow.new("RGB", (image.shape[1], _BAR), _PAPER)
    place = (image.shape[1] / 2, _BAR / 2)
    ImageDraw.Draw(bar).text(place, caption, _INK, ImageFont.load_default(_TEXT), anchor="mm")
    return np.vstack([image, np.asarray(bar)])


def _beside(cells: Sequence[Bytes]) -> Bytes:
    height = max(cell.shape[0] for cell in cells)
    return np.hstack([_padded(cell, height, cell.shape[1]) for cell in cells])


def _padded(image: Bytes, height: int, width: int) -> Bytes:
    room: Bytes = np.full((height, width, 3), _PAPER, np.uint8)
    room[: image.shape[0], : image.shape[1]] = image
    return room
