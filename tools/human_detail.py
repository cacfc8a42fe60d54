"""Make src/dermis/human/data/detail.png: tiles of skin with pores and with fine furrows."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from dermis.base.command_line import run_script
from dermis.human.skin.textures import MAX_TILE_HEIGHT_MM, TILE_LENGTH_MM, TILE_SIDE

Doubles = NDArray[np.float64]

OUT = Path(__file__).parent.parent / "src" / "dermis" / "human" / "data" / "detail.png"
PORES_A_SIDE = 30
PORE_MM = (0.06, 0.19)
"""Radius of the smallest and the largest pore [mm], an artist's choice."""
PORE_DEPTH_MM = (0.03, 0.085)  # of the smallest and the largest pore
CELLS_A_SIDE, FINE_CELLS_A_SIDE = 44, 92
"""Cells per side of the coarse and the fine net of furrows, 0.7 and 0.35 mm wide."""
FURROW_MM, FURROW_DEPTH_MM, CUSHION_MM = 0.11, 0.032, 0.016  # width and depth of furrows, height of cells
FINE_FRACTION = 0.4  # height of the fine net relative to the coarse net
BLUR_TEXELS = 0.6
"""Standard deviation of the final blur [texels]."""


def main() -> None:
    """Build the tiles and write the file."""
    rng = np.random.default_rng(0)
    across = (np.arange(TILE_SIDE) + 0.5) * TILE_LENGTH_MM / TILE_SIDE
    positions = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    layers = [pores(positions, rng), furrows(positions, rng), np.zeros(len(positions))]
    heights = gaussian_filter(
        np.stack(layers, axis=-1).reshape(TILE_SIDE, TILE_SIDE, 3), (BLUR_TEXELS, BLUR_TEXELS, 0), mode="wrap"
    )
    levels = np.clip(np.rint(255 * (heights / MAX_TILE_HEIGHT_MM + 0.75)), 0, 255).astype(np.uint8)
    Image.fromarray(levels).save(OUT, optimize=True)
    sys.stdout.write(f"{OUT}  {OUT.stat().st_size / 1e3:.0f} kB\n")


def jittered_grid(count: int, rng: np.random.Generator, spread: float = 0.85) -> Doubles:
    """Return (count², 2) jittered positions, one in each cell of a grid over the tile [mm]."""
    cell = np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2)
    return np.asarray(
        (cell + 0.5 + spread * (rng.random(cell.shape) - 0.5)) * TILE_LENGTH_MM / count % TILE_LENGTH_MM
    )


def pores(positions: Doubles, rng: np.random.Generator) -> Doubles:
    """Return the (n,) height of skin with pores, elliptic pits of several sizes and directions [mm]."""
    middle = jittered_grid(PORES_A_SIDE, rng)
    share = rng.random(len(middle)) ** 1.3
    radius, depth = (low + share * (high - low) for low, high in (PORE_MM, PORE_DEPTH_MM))
    depth *= rng.random(len(middle)) < 0.85
    turn, long = rng.uniform(0, np.pi, len(middle)), rng.uniform(1.0, 1.5, len(middle))
    _, near = nearest(positions, middle, 3)
    height = np.zeros(len(positions))
    for which in near.T:
        off = wrapped(positions - middle[which])
        c, s = np.cos(turn[which]), np.sin(turn[which])
        along, beside = c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]
        square = (along / long[which]) ** 2 + beside**2
        height -= depth[which] * np.exp(-square / (0.7 * radius[which]) ** 2)
    return height


def furrows(positions: Doubles, rng: np.random.Generator) -> Doubles:
    """Return the (n,) height of skin with a coarse and a fine net of furrows [mm]."""
    coarse = net(positions, CELLS_A_SIDE, 1.0, rng)
    return np.asarray(coarse + FINE_FRACTION * net(positions, FINE_CELLS_A_SIDE, 0.55, rng))


def net(positions: Doubles, count: int, size: float, rng: np.random.Generator) -> Doubles:
    """Return the (n,) height of a net of furrows between convex cells [mm].

    count : number of cells per side of the tile
    size : width of the furrows relative to `FURROW_MM`
    """
    middle = jittered_grid(count, rng, 0.8)
    uneven = 0.5 + rng.random(len(middle))
    distance, near = nearest(positions, middle, 2)
    between = distance[:, 1] - distance[:, 0]
    depth = FURROW_DEPTH_MM * 0.5 * uneven[near].sum(axis=1)
    cushion = CUSHION_MM * np.minimum(between / (TILE_LENGTH_MM / count), 1.0)
    return np.asarray(cushion - depth * np.exp(-((between / (size * FURROW_MM)) ** 2)))


def nearest(positions: Doubles, middle: Doubles, k: int) -> tuple[Doubles, NDArray[np.intp]]:
    """Return the (n, k) distances to the nearest positions on the tile, and their indices."""
    box: Any = TILE_LENGTH_MM
    distance, which = cKDTree(middle, boxsize=box).query(positions, k=k)
    return np.asarray(distance), np.asarray(which)


def wrapped(off: Doubles) -> Doubles:
    """Return differences of positions on the periodic tile, by the shortest path [mm]."""
    return np.asarray((off + TILE_LENGTH_MM / 2) % TILE_LENGTH_MM - TILE_LENGTH_MM / 2)


if __name__ == "__main__":
    run_script(main)
