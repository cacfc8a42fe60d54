"""Make src/dermis/human/data/detail.png: tiles of skin with pores, and with fine lines and follicles.

Both tiles are for tension lines along +u. Shaders rotate them to the tension lines of each site.
"""

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
# Artist's values. Follicles: about 2 to 4 per square millimetre of face.
PORES_PER_SIDE, FOLLICLES_PER_SIDE = 34, 58
PORE_MM, PORE_DEPTH_MM = (0.055, 0.20), (0.03, 0.105)
"""Radius and depth of the smallest and the largest pore [mm]."""
FOLLICLE_MM, FOLLICLE_DEPTH_MM = (0.04, 0.075), (0.010, 0.03)
COARSE_CELLS, FINE_CELLS = (24, 46), (56, 104)
"""Number of cells of the coarse and of the fine net of lines, along the tension lines and across them."""
LINE_MM, LINE_DEPTH_MM = 0.085, 0.046
"""Half width and depth of the deepest lines, which follow the tension lines [mm]."""
CROSS_LINE_DEPTH = 0.45
"""Depth of lines across the tension lines, relative to lines along them [-]."""
MISSING_LINES = 0.3
"""Fraction of the borders between cells that have no line [-]."""
CELL_MM = 0.012
"""Range of the random heights of cells [mm]."""
FINE_FRACTION = 0.55  # height of the fine net relative to the coarse net
BUMP_MM = 0.007
"""Standard deviation of the height of soft bumps [mm]."""
WARP_MM = 0.22
"""Standard deviation of the displacement of the nets, which makes lines uneven [mm]."""
PIT_TURN_RADIANS = 0.4
"""Standard deviation of the angle between elongated pits and the tension lines [rad]."""
BLUR_TEXELS = 0.5
"""Standard deviation of the final blur [texels]."""


def main() -> None:
    """Build the tiles and write the file."""
    rng = np.random.default_rng(0)
    across = (np.arange(TILE_SIDE) + 0.5) * TILE_LENGTH_MM / TILE_SIDE
    positions = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    pores = pits(positions, PORES_PER_SIDE, PORE_MM, PORE_DEPTH_MM, rng)
    fine = pits(positions, FOLLICLES_PER_SIDE, FOLLICLE_MM, FOLLICLE_DEPTH_MM, rng)
    layers = [pores, fine + lines(positions, rng), np.zeros(len(positions))]
    heights = gaussian_filter(
        np.stack(layers, axis=-1).reshape(TILE_SIDE, TILE_SIDE, 3), (BLUR_TEXELS, BLUR_TEXELS, 0), mode="wrap"
    )
    levels = np.clip(np.rint(255 * (heights / MAX_TILE_HEIGHT_MM + 0.75)), 0, 255).astype(np.uint8)
    Image.fromarray(levels).save(OUT, optimize=True)
    sys.stdout.write(f"{OUT}  {OUT.stat().st_size / 1e3:.0f} kB\n")


def jittered_grid(
    columns: int, rows: int, rng: np.random.Generator, spread: float = 0.85
) -> tuple[Doubles, Doubles]:
    """Return (n, 2) jittered positions, one in each cell of a grid on the tile, and the cell's size [mm]."""
    cell = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    size = TILE_LENGTH_MM / np.array([columns, rows])
    return (cell + 0.5 + spread * (rng.random(cell.shape) - 0.5)) * size % TILE_LENGTH_MM, size


def pits(
    positions: Doubles,
    count: int,
    radii_mm: tuple[float, float],
    depths_mm: tuple[float, float],
    rng: np.random.Generator,
) -> Doubles:
    """Return the (n,) height of skin with pits of several sizes, elongated along the tension lines [mm].

    count : number of pits per side of the tile
    radii_mm, depths_mm : radius and depth of the smallest and the largest pit
    """
    middle, _ = jittered_grid(count, count, rng)
    share = rng.random(len(middle)) ** 1.8  # few pits are large
    radius, depth = (low + share * (high - low) for low, high in (radii_mm, depths_mm))
    depth *= (rng.random(len(middle)) < 0.88) * rng.uniform(0.55, 1.0, len(middle))
    turn, long = PIT_TURN_RADIANS * rng.normal(size=len(middle)), rng.uniform(1.0, 1.8, len(middle))
    _, near = nearest(positions, middle, 3)
    height = np.zeros(len(positions))
    for which in near.T:
        off = wrapped(positions - middle[which])
        c, s = np.cos(turn[which]), np.sin(turn[which])
        along, beside = c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]
        square = (along / long[which]) ** 2 + beside**2
        height -= depth[which] * np.exp(-((square / (0.75 * radius[which]) ** 2) ** 1.3))
    return height


def lines(positions: Doubles, rng: np.random.Generator) -> Doubles:
    """Return the (n,) height of skin with soft bumps, and a coarse and a fine net of lines [mm]."""
    warp = np.stack([smooth_noise(WARP_MM, 12.0, rng) for _ in range(2)], axis=-1)
    bumps = smooth_noise(BUMP_MM, 3.0, rng)
    coarse = net((positions + warp) % TILE_LENGTH_MM, COARSE_CELLS, 1.0, rng)
    return np.asarray(bumps + coarse + FINE_FRACTION * net(positions, FINE_CELLS, 0.6, rng))


def smooth_noise(deviation: float, texels: float, rng: np.random.Generator) -> Doubles:
    """Return periodic noise (n,) with a standard deviation, smoothed by a Gaussian of a width in texels."""
    noise = gaussian_filter(rng.normal(size=(TILE_SIDE, TILE_SIDE)), texels, mode="wrap")
    return np.asarray((deviation / noise.std() * noise).ravel())


def net(positions: Doubles, cells: tuple[int, int], width: float, rng: np.random.Generator) -> Doubles:
    """Return the (n,) height of a net of lines between cells that are elongated along the tension lines [mm].

    cells : number of cells along the tension lines and across them
    width : width of the lines relative to `LINE_MM`
    """
    middle, size = jittered_grid(*cells, rng, 0.9)
    stretch = np.array([size[1] / size[0], 1.0])
    distance, near = nearest(positions * stretch, middle * stretch, 2, TILE_LENGTH_MM * stretch)
    between = wrapped(middle[near[:, 1]] - middle[near[:, 0]])
    between /= np.linalg.norm(between, axis=1, keepdims=True)
    along = np.abs(between[:, 1]) ** 2  # 1 for a line along the tension lines
    pair = np.sort(near, axis=1) @ np.array([7919, 104729]) % 8191
    uneven = rng.random(8191)[pair]
    depth = LINE_DEPTH_MM * np.clip((uneven - MISSING_LINES) / (1.0 - MISSING_LINES), 0.0, 1.0) ** 0.7
    depth *= CROSS_LINE_DEPTH + (1.0 - CROSS_LINE_DEPTH) * along
    gap = distance[:, 1] - distance[:, 0]
    rise = 1.0 - np.exp(-((gap / (2.0 * width * LINE_MM)) ** 2))  # 0 at borders, to avoid steps
    level = CELL_MM * (rng.random(len(middle)) - 0.5)[near[:, 0]]
    return np.asarray(rise * level - depth * np.exp(-((gap / (width * LINE_MM)) ** 2)))


def nearest(
    positions: Doubles, middle: Doubles, k: int, box: Any = TILE_LENGTH_MM
) -> tuple[Doubles, NDArray[np.intp]]:
    """Return the (n, k) distances to the nearest positions on the periodic tile, and their indices."""
    distance, which = cKDTree(middle % box, boxsize=box).query(positions % box, k=k)
    return np.asarray(distance), np.asarray(which)


def wrapped(off: Doubles) -> Doubles:
    """Return differences of positions on the periodic tile, by the shortest path [mm]."""
    return np.asarray((off + TILE_LENGTH_MM / 2) % TILE_LENGTH_MM - TILE_LENGTH_MM / 2)


if __name__ == "__main__":
    run_script(main)
