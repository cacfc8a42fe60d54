"""Random textures in space, from random numbers at the points of a lattice, and scattered dots."""

from __future__ import annotations

import math

import numpy as np

from dermis.human.bust.fields import Doubles
from dermis.machine_code import compiled

_ALONG_I, _ALONG_J = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F)
_ALONG_K, _ALONG_SEED = np.uint64(0x165667B19E3779F9), np.uint64(0xD6E8FEB86659FD93)
# The twelve directions to the edges of a cube, four of them twice: a table, because branches are slower.
_EDGES = np.array(
    [
        [1, 1, 0], [-1, 1, 0], [1, -1, 0], [-1, -1, 0], [1, 0, 1], [-1, 0, 1], [1, 0, -1], [-1, 0, -1],
        [0, 1, 1], [0, -1, 1], [0, 1, -1], [0, -1, -1], [1, 1, 0], [0, -1, 1], [-1, 1, 0], [0, -1, -1],
    ],
    dtype=np.float64,
)  # fmt: skip


@compiled
def word_at(i: int, j: int, k: int, seed: int) -> np.uint64:
    """64 random bits of a lattice point.

    Source: [Steele2014] for the mixing of bits.
    """
    z = np.uint64(i) * _ALONG_I + np.uint64(j) * _ALONG_J + np.uint64(k) * _ALONG_K
    return _mixed(z + np.uint64(seed) * _ALONG_SEED)


@compiled
def _mixed(z: np.uint64) -> np.uint64:
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.uint64(z ^ (z >> np.uint64(31)))


@compiled
def share(word: np.uint64, part: int) -> float:
    """A number from 0 to 1 out of a third of a word; part 0, 1 or 2."""
    bits = (word >> np.uint64(21 * part)) & np.uint64(0x1FFFFF)
    return float(bits) * (1.0 / 2097152.0)


@compiled
def _slope(word: np.uint64, x: float, y: float, z: float) -> float:
    """Product of (x, y, z) with the direction of a lattice point."""
    edge = _EDGES[word & np.uint64(15)]
    return float(edge[0] * x + edge[1] * y + edge[2] * z)


@compiled
def _fade(t: float) -> float:
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0)


@compiled
def gradient_noise(x: float, y: float, z: float, seed: int) -> float:
    """Smooth noise of about -1 to 1, its blobs one unit large.

    Source: [Perlin2002].
    """
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    x, y, z = x - i, y - j, z - k
    u, v, w = _fade(x), _fade(y), _fade(z)
    total = 0.0
    for c in range(2):
        for b in range(2):
            near = _slope(word_at(i, j + b, k + c, seed), x, y - b, z - c)
            far = _slope(word_at(i + 1, j + b, k + c, seed), x - 1.0, y - b, z - c)
            total += (near + u * (far - near)) * (v if b else 1.0 - v) * (w if c else 1.0 - w)
    return total


@compiled
def blobs(x: float, y: float, z: float, blob_mm: float, seed: int) -> float:
    """Gradient noise at a place [mm] with blobs of this size."""
    return gradient_noise(x / blob_mm, y / blob_mm, z / blob_mm, seed)


@compiled
def fractal_noise(
    x: float, y: float, z: float, blob_mm: float, gain: float, texel_mm: float, seed: int
) -> float:
    """Noise of many sizes, from `blob_mm` down in halves to what texels can show.

    gain : strength of each size over that of the size before [-]
    """
    total, strength = 0.0, 1.0
    for octave in range(10):
        shown = visible(blob_mm, texel_mm)
        if shown == 0.0:
            break
        total += strength * shown * blobs(x, y, z, blob_mm, seed + octave)
        # turned, so that the lattices of the sizes never line up
        x, y, z = 0.36 * x + 0.48 * y - 0.8 * z, -0.8 * x + 0.6 * y, 0.48 * x + 0.64 * y + 0.6 * z
        strength *= gain
        blob_mm *= 0.49
    return total


@compiled
def visible(blob_mm: float, texel_mm: float) -> float:
    """How much of noise with blobs of this size texels can show: none under two texels, all over four [-]."""
    return min(max(0.5 * blob_mm / texel_mm - 1.0, 0.0), 1.0)


@compiled
def smooth_step(low: float, high: float, value: float) -> float:
    """From 0 at `low` to 1 at `high`, level at both."""
    t = min(max((value - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@compiled
def dots(
    x: float,
    y: float,
    z: float,
    normal: Doubles,
    spacing_mm: float,
    smallest: float,
    largest: float,
    kept: float,
    texel_mm: float,
    seed: int,
) -> float:
    """Round soft dots, 1 at the middle of one.

    x, y, z : place [mm]
    normal : (3,) unit normal of the surface there
    spacing_mm : of the dots, if all were kept [mm]
    smallest, largest : radius of the dots, up to 0.5 [of the spacing]
    kept : share of them that is shown, some of them faintly [-]
    texel_mm : a dot is as wide as texels need, and fainter by as much [mm]

    Source: [Worley1996] for points in the cells of a lattice.
    """
    x, y, z = x / spacing_mm, y / spacing_mm, z / spacing_mm
    blur = (1.2 * texel_mm / spacing_mm) ** 2
    first_i, first_j, first_k = math.floor(x - 0.5), math.floor(y - 0.5), math.floor(z - 0.5)
    total = 0.0
    for i in range(first_i, first_i + 2):
        for j in range(first_j, first_j + 2):
            for k in range(first_k, first_k + 2):
                word = word_at(i, j, k, seed)
                dx, dy, dz = x - i - share(word, 0), y - j - share(word, 1), z - k - share(word, 2)
                away = dx * dx + dy * dy + dz * dz
                if away < 0.25:
                    off = dx * normal[0] + dy * normal[1] + dz * normal[2]
                    other = word_at(i, j, k, seed + 1)
                    total += _dot(away, off, other, smallest, largest, kept, blur)
    return min(total, 1.0)


@compiled
def _dot(
    away: float, off: float, word: np.uint64, smallest: float, largest: float, kept: float, blur: float
) -> float:
    """One dot, from the squared distance to its middle and the distance along the normal [of the spacing].

    It is round in the surface, and fades with its middle's distance from the surface.
    """
    shown = min(max(4.0 * (kept - share(word, 0)) + kept, 0.0), 1.0)
    radius = smallest + (largest - smallest) * share(word, 1) ** 2
    reach = min(radius * radius + blur, 0.25)
    beside = max(1.0 - (away - off * off) / reach, 0.0)
    near = 1.0 - 4.0 * away
    return shown * near * near * beside * beside * beside * radius * radius / reach
