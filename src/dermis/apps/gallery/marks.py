"""Landmarks drawn on a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.frame.observation import Landmarks

_RADIUS, _SEEN, _HIDDEN = 2.0, (90, 255, 120), (255, 70, 70)


def marked(picture: NDArray[np.uint8], landmarks: Landmarks) -> NDArray[np.uint8]:
    """(h, w, 3) the picture with a dot on each landmark: green where it is seen, red where it is hidden."""
    from PIL import Image, ImageDraw

    image = Image.fromarray(np.ascontiguousarray(picture[..., :3]))
    draw = ImageDraw.Draw(image)
    for (x, y), visible in zip(landmarks.pixels.tolist(), landmarks.visible.tolist(), strict=True):
        box = (x - _RADIUS, y - _RADIUS, x + _RADIUS, y + _RADIUS)
        draw.ellipse(box, fill=_SEEN if visible else _HIDDEN)
    return np.array(image)
