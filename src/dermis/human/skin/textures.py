"""Random textures of skin: noises, scattered dots, and a tile of fine relief."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import resources
from io import BytesIO
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Space = Literal["body", "lip", "level", "ring"]
SPACES: tuple[Space, ...] = ("body", "lip", "level", "ring")
"""What noise is a function of: the place on the body; that with x bent along the creases of the lips; with y
bent along the lines of the forehead; and the distance from the eye with x and y."""
Ground = Literal["all", "lips", "lines", "furrows", "folds", "veins", "hairline"]
GROUNDS: tuple[Ground, ...] = ("all", "lips", "lines", "furrows", "folds", "veins", "hairline")
"""Where noise shows: all over, on lips, fine lines, these or folds, folds, veins, or at the hairline."""
_TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
"""From each size of a fractal to the next: their lattices never line up."""
_SHRINK = 0.49
WANDERING = 2
"""How many of the first noises, of a single octave, bend the borders of zones."""
SIDE = 512
"""Of the tile [texels]."""
TILE_MM = 32.0
"""Its length on the skin [mm]."""
FULL_MM = 0.2
"""Full scale of its heights [mm]."""


class Noise(NamedTuple):
    """A texture of about -1 to 1, by gradient noise.

    blob_mm : size of its blobs along the three axes of its space [mm]
    gain, octaves : of a fractal: strength of each size over that of the one before, and how many
    fades : whether it is left out where texels cannot show it
    ground : where it shows; elsewhere it is not made
    """

    name: str
    blob_mm: tuple[float, float, float]
    space: Space = "body"
    gain: float = 1.0
    octaves: int = 1
    fades: bool = False
    ground: Ground = "all"


def _even(
    name: str,
    blob_mm: float,
    gain: float = 1.0,
    octaves: int = 1,
    fades: bool = False,
    ground: Ground = "all",
) -> Noise:
    return Noise(name, (blob_mm, blob_mm, blob_mm), "body", gain, octaves, fades, ground)


# Artist's values [mm]. Those that bend a space come before the ones in it, and those that bend zones first.
NOISES = (
    _even("wander-x", 17.0),
    _even("wander-y", 17.0),
    _even("lip-edge", 1.6, ground="lips"),
    _even("patches", 24.0, 0.75, 5, fades=True),
    _even("blotches", 19.0, 0.86, 6, fades=True),
    _even("oil-film", 8.0),
    _even("fine-film", 1.9, fades=True),
    _even("roughness", 9.0),
    _even("grain", 2.6, 0.62, 3, fades=True),
    _even("lumps", 1.3, fades=True),
    _even("sun", 14.0),
    _even("ragged-x", 1.3),
    _even("ragged-y", 1.3),
    _even("hairline", 14.0, ground="hairline"),
    _even("fine-hairline", 3.0, ground="hairline"),
    _even("veins", 11.0, ground="veins"),
    _even("line-bend", 5.0, ground="lines"),
    _even("line-depth", 7.0, ground="furrows"),
    _even("crease-bend", 3.2, ground="lips"),
    _even("crease-depth", 4.0, ground="lips"),
    _even("fold-bend-x", 19.0, ground="folds"),
    _even("fold-bend-y", 21.0, ground="folds"),
    _even("fine-fold-bend", 5.5, ground="folds"),
    Noise("creases", (1.7, 9.0, 14.0), "lip", fades=True, ground="lips"),
    Noise("fine-creases", (0.8, 5.0, 9.0), "lip", fades=True, ground="lips"),
    Noise("lip-streaks", (1.6, 9.0, 9.0), "lip", ground="lips"),
    Noise("level-lines", (11.0, 1.5, 11.0), "level", fades=True, ground="lines"),
    Noise("eye-lines", (1.1, 9.0, 9.0), "ring", fades=True, ground="lines"),
)


class Dots(NamedTuple):
    """Round soft dots, one in each cell of a lattice at most.

    spacing_mm : of the cells [mm]
    smallest, largest : radius, up to 0.5 [of the spacing]
    ragged : by how much their edges are bent [mm]
    """

    name: str
    spacing_mm: float
    smallest: float
    largest: float
    ragged: float = 0.0


DOTS = (  # artist's values
    Dots("freckles", 4.2, 0.2, 0.5, 0.55),
    Dots("small-freckles", 2.2, 0.25, 0.5, 0.55),
    Dots("moles", 28.0, 0.045, 0.11, 0.4),
    Dots("age-spots", 17.0, 0.12, 0.34, 0.9),
    Dots("stubble", 0.85, 0.16, 0.26),
)


@cache
def noise_table() -> NDArray[np.float32]:
    """(n, 16) a row for each octave of each noise, as spot.wgsl reads it.

    Three rows of the matrix from its space to its lattice [1/mm], each with a number behind it: which size of
    texel shows it [mm], 0 for any; its strength; its seed. Then which noise it belongs to, which space, and
    where it shows.
    """
    rows = list(_rows())
    table = np.zeros((len(rows), 16), np.float32)
    for row, (matrix, finest_mm, gain, seed, *which) in zip(table, rows, strict=True):
        row[:12].reshape(3, 4)[:, :3] = matrix
        row[3], row[7] = finest_mm, gain
        row[11:15] = np.array([seed, *which], np.uint32).view(np.float32)
    return table


def _rows() -> Iterator[tuple[NDArray[np.float64], float, float, int, int, int, int]]:
    seed = 0
    for into, noise in enumerate(NOISES):
        matrix, gain, finest = np.diag(1.0 / np.array(noise.blob_mm)), 1.0, min(noise.blob_mm)
        space, ground = SPACES.index(noise.space), GROUNDS.index(noise.ground)
        for _ in range(noise.octaves):
            yield matrix, finest if noise.fades else 0.0, gain, seed, into, space, ground
            matrix, gain, finest = matrix @ _TURN / _SHRINK, gain * noise.gain, finest * _SHRINK
            seed += 1


def dot_table() -> NDArray[np.float32]:
    """(d, 4) spacing [mm], radii [of the spacing] and raggedness [mm]."""
    return np.array([dots[1:] for dots in DOTS], np.float32)


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
