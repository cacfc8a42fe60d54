"""What is finer than the texels of a person's maps: a tile of pores and one of furrows, the same for all."""

from __future__ import annotations

from functools import cache
from importlib import resources
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

SIDE = 512
"""Of the tile [texels]."""
TILE_MM = 32.0
"""Its length on the skin [mm]."""
FULL_MM = 0.2
"""Full scale of its heights [mm]."""


@cache
def detail_heights_mm() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(SIDE, SIDE) heights of pores and of furrows; they go on over the edges [mm]."""
    from PIL import Image

    file = resources.files("dermis.human").joinpath("data", "detail.png")
    levels = np.asarray(Image.open(BytesIO(file.read_bytes())), np.float32)
    pores, furrows = np.moveaxis(levels[..., :2] * np.float32(FULL_MM / 255), -1, 0)
    return pores, furrows


@cache
def detail_slopes() -> NDArray[np.float32]:
    """(SIDE, SIDE, 4) slopes of pores along +u and down, and of furrows; it goes on over the edges [-]."""
    heights = np.stack(detail_heights_mm(), axis=-1)
    per_mm = np.float32(SIDE / TILE_MM / 2)
    across, down = (per_mm * (np.roll(heights, -1, axis) - np.roll(heights, 1, axis)) for axis in (1, 0))
    return np.stack([across[..., 0], down[..., 0], across[..., 1], down[..., 1]], axis=-1)
