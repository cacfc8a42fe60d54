"""Panels of gallery pictures: conversion to sRGB, plots, landmarks, and sheets with captions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.extras import import_extra
from dermis.frame.observation import Landmarks
from dermis.images.colour import encode_srgb8
from dermis.scene.outputs import OUTPUTS

Image = NDArray[np.uint8] | NDArray[np.float32]
Panel = Image | list[Image]
"""A picture, or an animation as a list of frames."""
Panels = Mapping[str, Panel]
SrgbImage = NDArray[np.uint8]
_PLOT_SIDE_INCHES = 4.4
_CAPTION_HEIGHT_PX, _CAPTION_FONT_SIZE, _TEXT_COLOUR, _BACKGROUND = 24, 14, (200, 200, 206), (22, 22, 26)


def to_srgb8(image: Image) -> SrgbImage:
    """Convert an image to 8-bit sRGB; a floating-point image is taken to be linear light."""
    if image.dtype == np.uint8:
        return np.asarray(image, np.uint8)
    return encode_srgb8(np.maximum(image, 0.0).astype(np.float32))


def first_frame(panel: Panel) -> Image:
    """Return the first frame if a panel is an animation, otherwise the panel itself."""
    return panel[0] if isinstance(panel, list) else panel


def panel_sheet(panels: Panels, columns: int = 0) -> SrgbImage:
    """Arrange panels with captions in rows and return an sRGB image (h, w, 3).

    An animation is represented by its first frame.

    columns : number of panels in a row; 0 for a single row
    """
    cells = [_captioned_panel(to_srgb8(first_frame(panel)), name) for name, panel in panels.items()]
    step = columns or len(cells)
    rows = [_panel_row(cells[start : start + step]) for start in range(0, len(cells), step)]
    width = max(row.shape[1] for row in rows)
    return np.vstack([_pad_image(row, row.shape[0], width) for row in rows])


def plot_panel(draw_plot: Callable[[Any], Any], side: int = 448) -> SrgbImage:
    """Draw a matplotlib plot as a square sRGB image.

    draw_plot : function that draws into matplotlib axes
    side : side of the image [pixel]
    """
    canvases = import_extra("matplotlib.backends.backend_agg", "the gallery")
    figure = import_extra("matplotlib.figure", "the gallery").Figure(
        figsize=(_PLOT_SIDE_INCHES, _PLOT_SIDE_INCHES),
        dpi=side / _PLOT_SIDE_INCHES,
        facecolor="#141417",
        layout="constrained",
    )
    draw_plot(figure.subplots())
    canvas: Any = canvases.FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba(), np.uint8)[..., :3]


def _captioned_panel(image: SrgbImage, caption: str) -> SrgbImage:
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    bar = Pillow.new("RGB", (image.shape[1], _CAPTION_HEIGHT_PX), _BACKGROUND)
    centre = (image.shape[1] / 2, _CAPTION_HEIGHT_PX / 2)
    ImageDraw.Draw(bar).text(
        centre, caption, _TEXT_COLOUR, ImageFont.load_default(_CAPTION_FONT_SIZE), anchor="mm"
    )
    return np.vstack([image, np.asarray(bar)])


def _panel_row(captioned_panels: Sequence[SrgbImage]) -> SrgbImage:
    height = max(cell.shape[0] for cell in captioned_panels)
    return np.hstack([_pad_image(cell, height, cell.shape[1]) for cell in captioned_panels])


def _pad_image(image: SrgbImage, height: int, width: int) -> SrgbImage:
    padded: SrgbImage = np.full((height, width, 3), _BACKGROUND, np.uint8)
    padded[: image.shape[0], : image.shape[1]] = image
    return padded


_LANDMARK_DOT_RADIUS, _VISIBLE_LANDMARK_COLOUR, _HIDDEN_LANDMARK_COLOUR = 2.0, (90, 255, 120), (255, 70, 70)


def draw_landmarks(picture: NDArray[np.uint8], landmarks: Landmarks) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) with a dot at each landmark: green if visible, red if hidden."""
    from PIL import Image, ImageDraw

    image = Image.fromarray(np.ascontiguousarray(picture[..., :3]))
    draw = ImageDraw.Draw(image)
    for (x, y), visible in zip(landmarks.pixels.tolist(), landmarks.visible.tolist(), strict=True):
        box = (
            x - _LANDMARK_DOT_RADIUS,
            y - _LANDMARK_DOT_RADIUS,
            x + _LANDMARK_DOT_RADIUS,
            y + _LANDMARK_DOT_RADIUS,
        )
        draw.ellipse(box, fill=_VISIBLE_LANDMARK_COLOUR if visible else _HIDDEN_LANDMARK_COLOUR)
    return np.array(image)


_LIGHT_OUTPUT_FACTORS = {
    "albedo": 1.0,
    "irradiance": 1 / np.pi,
    "diffuse": 1.0,
    "specular": 1.0,
    "translucent": 4.0,
}
"""Factors by which render outputs that contain light are multiplied for display, by name of the output."""
_LABEL_COLOUR_COUNT = 8192
_DISPLAY_QUANTILES = 0.02, 0.98  # quantiles of non-zero values that are shown as black and white


def output_image(output_name: str, output_array: NDArray[Any]) -> NDArray[np.uint8]:
    """Convert a render output to an image (h, w, 3): light to sRGB, labels to random colours.

    Other outputs, such as depth, are scaled so that a low quantile is black and a high quantile is white.

    output_name : name of the render output, such as "depth"
    output_array : (h, w) or (h, w, c) array of the output
    """
    if output_name in _LIGHT_OUTPUT_FACTORS:
        return encode_srgb8(_LIGHT_OUTPUT_FACTORS[output_name] * output_array)
    if OUTPUTS[output_name].kind != "float32":
        colours = np.random.default_rng(8).integers(40, 255, (_LABEL_COLOUR_COUNT, 3), np.uint8)
        colours = colours[output_array.astype(int) % _LABEL_COLOUR_COUNT]
        return np.where((output_array != OUTPUTS[output_name].background)[..., None], colours, np.uint8(0))
    channels = output_array.reshape(*output_array.shape[:2], -1)[..., :3]
    nonzero = (channels != 0).any(axis=-1)
    low, high = np.quantile(channels[nonzero], _DISPLAY_QUANTILES, axis=0)
    levels = np.clip((channels - low) / np.maximum(high - low, 1e-6), 0.0, 1.0) * nonzero[..., None]
    if levels.shape[2] == 1:
        levels = levels.repeat(3, axis=2)
    padded = np.pad(levels, ((0, 0), (0, 0), (0, 3 - levels.shape[2])))
    return np.asarray(np.rint(255 * padded), np.uint8)
