"""Parameters of procedural skin textures: gradient noise, scattered dots, and a tile of pores and lines."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import resources
from io import BytesIO
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

NoiseSpace = Literal["body", "lip", "level", "ring"]
NOISE_SPACES: tuple[NoiseSpace, ...] = ("body", "lip", "level", "ring")
"""Coordinates in which noise is evaluated.

"body" is the position on the body. "lip" is this position with x warped along the creases of the lips, and
"level" is this position with y warped along the lines of the forehead. "ring" has the coordinates: distance
from the eye, x, and y.
"""
NoiseRegion = Literal["all", "lips", "lines", "furrows", "folds", "veins", "hairline"]
NOISE_REGIONS: tuple[NoiseRegion, ...] = ("all", "lips", "lines", "furrows", "folds", "veins", "hairline")
"""Parts of the skin with noise: "all" is everywhere, "lines" are fine lines, "furrows" lines and folds."""
_OCTAVE_ROTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
"""Rotation between octaves of a fractal, so that their lattices do not align."""
_OCTAVE_SIZE_RATIO = 0.49  # ratio of the feature sizes of consecutive octaves
ZONE_BORDER_NOISE_COUNT = 2
"""Number of noises that warp the borders of zones: the first of `NOISES`, with a single octave each."""
TILE_SIDE = 512
"""Side of the tile of fine relief [texel]."""
TILE_LENGTH_MM = 32.0
"""Length of the tile on the skin [mm]."""
MAX_TILE_HEIGHT_MM = 0.2
"""Full scale of the heights of the tile [mm]."""
_CAVITY_DEPTH_MM = 0.08  # depth below the median height of the tile at which a cavity reaches 1


class Noise(NamedTuple):
    """Fractal gradient noise, with values from about -1 to 1, that the paint shader evaluates.

    name : name of the noise in the shader
    feature_mm : size of the features of the noise along the three axes of `space` [mm]
    space : coordinates in which the noise is evaluated, one of `NOISE_SPACES`
    gain : ratio of the amplitudes of consecutive octaves
    octaves : number of octaves
    antialiased : whether octaves finer than a texel are left out
    region : part of the skin where the noise is evaluated, one of `NOISE_REGIONS`; the noise is 0 elsewhere
    """

    name: str
    feature_mm: tuple[float, float, float]
    space: NoiseSpace = "body"
    gain: float = 1.0
    octaves: int = 1
    antialiased: bool = False
    region: NoiseRegion = "all"


def _isotropic_noise(
    noise_name: str,
    feature_mm: float,
    gain: float = 1.0,
    octaves: int = 1,
    antialiased: bool = False,
    region: NoiseRegion = "all",
) -> Noise:
    return Noise(noise_name, (feature_mm, feature_mm, feature_mm), "body", gain, octaves, antialiased, region)


# Artist's values [mm]. Noises that warp zones come first, and those that warp a space before those in it.
NOISES = (
    _isotropic_noise("wander-x", 17.0),
    _isotropic_noise("wander-y", 17.0),
    _isotropic_noise("lip-edge", 1.6, region="lips"),
    _isotropic_noise("patches", 24.0, 0.75, 3, antialiased=True),
    _isotropic_noise("speckles", 2.9, 0.9, 2, antialiased=True),
    _isotropic_noise("blotches", 19.0, 0.8, 2, antialiased=True),
    _isotropic_noise("capillaries", 4.8, 0.9, 4, antialiased=True),
    _isotropic_noise("oil-film", 8.0),
    _isotropic_noise("fine-film", 1.9, antialiased=True),
    _isotropic_noise("roughness", 9.0),
    _isotropic_noise("grain", 2.6, 0.62, 2, antialiased=True),
    _isotropic_noise("sun", 14.0),
    _isotropic_noise("ragged-x", 1.3),
    _isotropic_noise("ragged-y", 1.3),
    _isotropic_noise("hairline", 14.0, region="hairline"),
    _isotropic_noise("fine-hairline", 3.0, region="hairline"),
    _isotropic_noise("veins", 11.0, region="veins"),
    _isotropic_noise("line-bend", 5.0, region="lines"),
    _isotropic_noise("line-depth", 7.0, region="furrows"),
    _isotropic_noise("crease-bend", 3.2, region="lips"),
    _isotropic_noise("crease-depth", 4.0, region="lips"),
    _isotropic_noise("fold-bend-x", 19.0, region="folds"),
    _isotropic_noise("fold-bend-y", 21.0, region="folds"),
    _isotropic_noise("fine-fold-bend", 5.5, region="folds"),
    Noise("creases", (1.7, 9.0, 14.0), "lip", antialiased=True, region="lips"),
    Noise("fine-creases", (0.8, 5.0, 9.0), "lip", antialiased=True, region="lips"),
    Noise("lip-streaks", (1.6, 9.0, 9.0), "lip", region="lips"),
    Noise("level-lines", (11.0, 1.5, 11.0), "level", antialiased=True, region="lines"),
    Noise("eye-lines", (1.1, 9.0, 9.0), "ring", antialiased=True, region="lines"),
)


class DotLayer(NamedTuple):
    """Layer of soft round dots, such as freckles, with at most one dot in each cell of a cubic lattice.

    name : name of the layer
    spacing_mm : side of the cells [mm]
    min_radius, max_radius : limits of the random radius as fractions of the spacing, up to 0.5
    edge_warp_mm : amplitude of the noise that distorts the outlines of the dots [mm]
    """

    name: str
    spacing_mm: float
    min_radius: float
    max_radius: float
    edge_warp_mm: float = 0.0


DOT_LAYERS = (  # artist's values
    DotLayer("freckles", 4.2, 0.2, 0.5, 0.55),
    DotLayer("small-freckles", 2.2, 0.25, 0.5, 0.55),
    DotLayer("moles", 28.0, 0.045, 0.11, 0.4),
    DotLayer("age-spots", 17.0, 0.12, 0.34, 0.9),
    DotLayer("stubble", 0.85, 0.16, 0.26),
    DotLayer("blemishes", 13.0, 0.07, 0.2, 0.5),
    DotLayer("scars", 5.0, 0.08, 0.26, 0.5),
)


@cache
def noise_table() -> NDArray[np.float32]:
    """Return the octaves of all noises as rows (n, 16), in the format that spot.wgsl reads.

    Columns 0 to 11 are three rows of four: the 3x3 matrix from the noise's space to its lattice [1/mm], each
    row followed by one scalar. The scalars are the feature size [mm] below which texels do not resolve the
    octave (0 if the noise is not antialiased), the amplitude of the octave, and the seed of the octave.
    Columns 12 to 14 are the indices of noise, space and region. Seed and indices are stored as the bits of
    uint32.
    """
    rows = list(_octave_rows())
    table = np.zeros((len(rows), 16), np.float32)
    for row, (matrix, finest_mm, gain, seed, *indices) in zip(table, rows, strict=True):
        row[:12].reshape(3, 4)[:, :3] = matrix
        row[3], row[7] = finest_mm, gain
        row[11:15] = np.array([seed, *indices], np.uint32).view(np.float32)
    return table


def noise_row_range(noise_name: str) -> tuple[int, int]:
    """Return the first row of a noise in `noise_table`, and the row after its last."""
    names, octaves = [noise.name for noise in NOISES], [noise.octaves for noise in NOISES]
    first = sum(octaves[: names.index(noise_name)])
    return first, first + octaves[names.index(noise_name)]


def _octave_rows() -> Iterator[tuple[NDArray[np.float64], float, float, int, int, int, int]]:
    seed = 0
    for noise_index, noise in enumerate(NOISES):
        matrix, gain, finest = np.diag(1.0 / np.array(noise.feature_mm)), 1.0, min(noise.feature_mm)
        space, region = NOISE_SPACES.index(noise.space), NOISE_REGIONS.index(noise.region)
        for _ in range(noise.octaves):
            yield matrix, finest if noise.antialiased else 0.0, gain, seed, noise_index, space, region
            matrix = matrix @ _OCTAVE_ROTATION / _OCTAVE_SIZE_RATIO
            gain, finest = gain * noise.gain, finest * _OCTAVE_SIZE_RATIO
            seed += 1


def dot_layer_table() -> NDArray[np.float32]:
    """Return the layers of dots as rows (d, 4): spacing [mm], minimum radius, maximum radius, edge warp [mm].

    The radii are fractions of the spacing.
    """
    return np.array([dots[1:] for dots in DOT_LAYERS], np.float32)


@cache
def detail_heights_mm() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the heights of pores and of lines as periodic tiles (TILE_SIDE, TILE_SIDE) [mm]."""
    from PIL import Image

    file = resources.files("dermis.human").joinpath("data", "detail.png")
    levels = np.asarray(Image.open(BytesIO(file.read_bytes())), np.float32)
    pores, lines = np.moveaxis(levels[..., :2] * np.float32(MAX_TILE_HEIGHT_MM / 255), -1, 0)
    return pores, lines


@cache
def detail_slopes() -> NDArray[np.float32]:
    """Return the slopes (TILE_SIDE, TILE_SIDE, 4) of the periodic tiles of pores and of lines [-].

    The channels are the slopes of the pores along +u and down, then the slopes of the lines along +u and
    down.
    """
    heights = np.stack(detail_heights_mm(), axis=-1)
    per_mm = np.float32(TILE_SIDE / TILE_LENGTH_MM / 2)
    across, down = (per_mm * (np.roll(heights, -1, axis) - np.roll(heights, 1, axis)) for axis in (1, 0))
    return np.stack([across[..., 0], down[..., 0], across[..., 1], down[..., 1]], axis=-1)


@cache
def detail_cavities() -> NDArray[np.float32]:
    """Return cavity values (TILE_SIDE, TILE_SIDE, 2) of the periodic tiles of pores and of lines [-].

    A value rises from 0 at the median height to 1 at `_CAVITY_DEPTH_MM` below it. The mean over the tile is
    subtracted, so that cavities do not change the mean colour of the skin.
    """
    heights = np.stack(detail_heights_mm(), axis=-1)
    depth = np.clip((np.median(heights, axis=(0, 1)) - heights) / np.float32(_CAVITY_DEPTH_MM), 0.0, 1.0)
    return np.asarray(depth - depth.mean(axis=(0, 1)), np.float32)
