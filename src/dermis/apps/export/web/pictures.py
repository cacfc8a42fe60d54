"""Maps as pictures: eight bits a channel, along a curve of each channel's own."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Halves = NDArray[np.float16]
LEAST = 64
"""Side of the smallest map that becomes a picture [texels]."""
_QUALITY = 88  # of WebP
_STEPS = 256
_COLOURS = 3


@dataclass(frozen=True)
class Picture:
    """A map's layer.

    data : WebP; of maps that are no colours grey, one channel below the other
    curves : (c, 256) what each of a channel's steps stands for
    texels : (h, w, c) what it is decoded to
    """

    data: bytes
    curves: Halves
    texels: Halves


def picture_of(texels: Halves, colours: bool) -> Picture:
    """A map as a picture.

    texels : (h, w, c)
    colours : whether the first three channels are seen as a colour; those after it are one number each
    """
    curves = np.stack([_curve(texels[..., k].astype(np.float64)) for k in range(texels.shape[2])])
    steps = np.stack([_steps(texels[..., k], curves[k]) for k in range(len(curves))], axis=-1)
    image = steps[..., :_COLOURS] if colours else steps.transpose(2, 0, 1).reshape(-1, steps.shape[1])
    data = _encoded(image)
    found = _decoded(data)
    if colours:
        found = np.concatenate([found, steps[..., _COLOURS:]], axis=-1)
        found[..., _COLOURS:] = steps[:1, :1, _COLOURS:]  # one number each
    else:
        found = found[..., 0].reshape(len(curves), *texels.shape[:2]).transpose(1, 2, 0)
    decoded = np.stack([curves[k][found[..., k]] for k in range(len(curves))], axis=-1)
    return Picture(data, curves.astype(np.float16), decoded.astype(np.float16))


def _curve(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(256,) values from the least to the largest, closer together near 0 as eyes and slopes are."""
    low, high = _bent(float(values.min())), _bent(float(values.max()))
    return _straight(np.linspace(low, high, _STEPS))


def _bent(value: float) -> float:
    return float(np.sign(value) * np.sqrt(abs(value)))


def _straight(bent: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sign(bent) * bent * bent)


def _steps(values: Halves, curve: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The nearest step of the curve to each value."""
    middles = 0.5 * (curve[1:] + curve[:-1])
    return np.searchsorted(middles, values.astype(np.float64)).astype(np.uint8)


def _encoded(image: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    into = io.BytesIO()
    Image.fromarray(image).save(into, "WEBP", quality=_QUALITY, method=4)
    return into.getvalue()


def _decoded(data: bytes) -> NDArray[np.uint8]:
    """(h, w, 3)"""
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
