"""Eyelashes: rows of hairs along the edges of the lids, which curve away from the eye to a point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.human.hair.brows import KNOTS

_ALONG = np.array([0.0, 0.15, 0.35, 0.55, 0.75, 0.9, 1.0])


class LashRow(NamedTuple):
    """The lashes of one lid.

    loop : control points of the left lid's edge, from the nose outwards
    hairs : how many
    first, last : between which parts of the edge
    length : along the edge [mm]
    rise : angles from straight ahead to upwards, of the root and of the tip [rad]
    splay : towards the sides, at the inner and at the outer end
    radius : of the roots [mm]
    """

    edge_points: tuple[int, ...]
    hairs: int
    first: float
    last: float
    length: Doubles
    rise: tuple[float, float]
    splay: tuple[float, float]
    radius: float


UPPER_LASHES = LashRow(
    edge_points=(2625, 2664, 2622, 2619, 2616, 2563, 2562, 2568, 2571, 2574, 2577, 2580),
    hairs=165,
    first=0.14,
    last=0.96,
    length=np.array([5.0, 7.0, 8.6, 9.6, 10.0, 9.2, 7.2]),
    rise=(-0.3, 1.15),
    splay=(-0.35, 0.55),
    radius=0.041,
)
LOWER_LASHES = LashRow(
    edge_points=(2634, 2615, 4280, 2612, 2609, 2606, 2603, 2598, 2595, 2592, 4278),
    hairs=84,
    first=0.2,
    last=0.95,
    length=np.array([2.8, 3.4, 4.0, 4.6, 5.2, 5.0, 4.0]),
    rise=(-0.25, -0.85),
    splay=(-0.3, 0.5),
    radius=0.033,
)


def sample_positions(lid: LashRow, rng: np.random.Generator) -> tuple[Doubles, Doubles]:
    """Along the lid's edge, evenly but for chance, and from the edge onto the skin, each (n,)."""
    u = (np.arange(lid.hairs) + rng.uniform(-0.3, 1.3, lid.hairs)) / lid.hairs
    across = 0.04 + 0.12 * rng.integers(0, 3, lid.hairs)
    return lid.first + (lid.last - lid.first) * np.clip(u, 0, 1), np.asarray(across, np.float64)


def sample_shapes(lid: LashRow, u: Doubles, rng: np.random.Generator, before: int) -> Doubles:
    """(7, n) how far lashes splay, the angles of their first and last piece [rad], their length, the radius
    of their roots [mm], the number of their clump and how much of the way to its middle their tips are drawn.

    u : (n,) along the lid's edge, from `sample_positions`
    before : how many clumps other lids may have
    """
    n, share = len(u), (u - lid.first) / (lid.last - lid.first)
    splay = np.interp(share, [0, 1], lid.splay) + rng.normal(0, 0.1, n)
    first = lid.rise[0] + rng.normal(0, 0.12, n)
    last = lid.rise[1] + rng.normal(0, 0.18, n)
    length = np.interp(share, _ALONG, lid.length) * rng.uniform(0.7, 1.08, n)
    clump = np.empty(n)  # of neighbours, as wet lashes stick to each other
    clump[np.argsort(u)] = before + np.cumsum(rng.random(n) < 0.4)
    pull = rng.uniform(0.2, 0.7, n)
    radius = lid.radius * rng.uniform(0.8, 1.15, n)
    return np.stack([splay, first, last, length, radius, clump, pull])


def grow(root_mm: Doubles, eye_mm: Doubles, side: Doubles, shape: Doubles) -> tuple[Doubles, Doubles]:
    """Knots (n, k, 3) and radii (n, k) of lashes [mm].

    root_mm, eye_mm : (n, 3) on the lids, and middles of their eyes
    side : (n,) 1 for the left one
    shape : (7, n) from `sample_shapes`; no clump has lashes of two lids
    """
    splay, first, last, length, radius, clump, pull = shape
    ahead = root_mm - eye_mm
    ahead = ahead * [0.55, 0.0, 1.0]  # lashes fan out less than the eye is round
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0])
    out = np.cross(up, ahead) * side[:, None]
    t = np.linspace(0.0, 1.0, KNOTS)
    angle = first + (last - first) * ((t[1:] - 0.5 / (KNOTS - 1)) ** 0.8)[:, None]
    directions = np.cos(angle)[..., None] * ahead + np.sin(angle)[..., None] * up
    directions += (splay * (0.4 + 0.6 * t[1:, None]))[..., None] * out
    directions /= np.sqrt((directions**2).sum(axis=-1, keepdims=True))
    steps = (length / (KNOTS - 1))[:, None] * directions
    knots = np.cumsum(np.concatenate([[root_mm - 0.25 * ahead], steps]), axis=0).swapaxes(0, 1)
    clumped = _clump_tips(knots, clump.astype(np.int64), pull, t)
    return clumped, radius[:, None] * np.maximum(1.0 - t, 0.0) ** 0.55 * np.minimum(1.0, 0.8 + t)


def _clump_tips(knots: Doubles, clump: NDArray[np.int64], strength: Doubles, t: Doubles) -> Doubles:
    """Tips drawn together in clumps."""
    count = np.maximum(np.bincount(clump), 1)
    mean = np.stack([np.bincount(clump, knots[:, -1, c]) / count for c in range(3)], axis=-1)
    pull = (mean[clump] - knots[:, -1]) * strength[:, None]
    return np.asarray(knots + (t**1.6)[None, :, None] * pull[:, None])
