"""Eyelashes: rows of tapered hairs along the edges of the lids, curved away from the eye."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.human.hair.brows import KNOTS_PER_HAIR

_LINE_DISTANCES = np.array([0.04, 0.22])  # of the two lines of roots from the edge of a lid, see `LashRow`
_CLUMP_SPACING = 0.024  # mean distance between clumps, as a fraction of the row
_POSITIONS_ALONG_ROW = np.array([0.0, 0.15, 0.35, 0.55, 0.75, 0.9, 1.0])


class LashRow(NamedTuple):
    """Row of lashes on the edge of one lid.

    edge_points : control points along the edge of the left lid, from the nose outwards
    hairs : number of lashes
    start, end : ends of the row, as fractions of the arc length of the edge
    length : (7,) lengths of lashes at the positions `_POSITIONS_ALONG_ROW` along the row [mm]
    rise : elevation of lashes above the forward direction at root and tip, negative downwards [rad]
    splay : sideways inclination of lashes at the inner and the outer end of the row [-]
    radius : radius of the lashes at the root [mm]
    """

    edge_points: tuple[int, ...]
    hairs: int
    start: float
    end: float
    length: Doubles
    rise: tuple[float, float]
    splay: tuple[float, float]
    radius: float


UPPER_LASHES = LashRow(
    edge_points=(2625, 2664, 2622, 2619, 2616, 2563, 2562, 2568, 2571, 2574, 2577, 2580),
    hairs=220,
    start=0.14,
    end=0.96,
    length=np.array([5.0, 7.0, 8.6, 9.6, 10.0, 9.2, 7.2]),
    rise=(-0.3, 1.1),
    splay=(-0.35, 0.55),
    radius=0.036,
)
LOWER_LASHES = LashRow(
    edge_points=(2634, 2615, 4280, 2612, 2609, 2606, 2603, 2598, 2595, 2592, 4278),
    hairs=116,
    start=0.2,
    end=0.95,
    length=np.array([2.8, 3.4, 4.0, 4.6, 5.2, 5.0, 4.0]),
    rise=(-0.25, -0.85),
    splay=(-0.3, 0.5),
    radius=0.028,
)


def sample_positions(lash_row: LashRow, rng: np.random.Generator) -> tuple[Doubles, Doubles]:
    """Return random root positions of lashes on a lid, as two arrays (n,) of coordinates from 0 to 1.

    The coordinates are `edge_position` and `edge_distance` of `RootFinder.lid_edge_roots`.
    """
    u = (np.arange(lash_row.hairs) + rng.uniform(-0.3, 1.3, lash_row.hairs)) / lash_row.hairs
    across = _LINE_DISTANCES[rng.integers(0, 2, lash_row.hairs)] + rng.uniform(0.0, 0.06, lash_row.hairs)
    return lash_row.start + (lash_row.end - lash_row.start) * np.clip(u, 0, 1), np.asarray(across, np.float64)


def sample_shapes(
    lash_row: LashRow, edge_position: Doubles, rng: np.random.Generator, first_clump: int
) -> Doubles:
    """Return random shape parameters (7, n) of lashes.

    The seven rows are: the splay [-], the elevation of the first segment [rad], the elevation of the last
    segment [rad], the length [mm], the radius at the root [mm], the index of the lash's clump, and the
    attraction of the tip to this clump, 0 to 1.

    edge_position : (n,) positions along the edge of the lid, from `sample_positions`
    first_clump : index of the first clump of this row
    """
    n, fraction = len(edge_position), (edge_position - lash_row.start) / (lash_row.end - lash_row.start)
    splay = np.interp(fraction, [0, 1], lash_row.splay) + rng.normal(0, 0.1, n)
    first = lash_row.rise[0] + rng.normal(0, 0.12, n)
    last = lash_row.rise[1] + rng.normal(0, 0.18, n)
    variation = np.minimum(rng.uniform(0.75, 1.08, n), rng.uniform(0.45, 1.9, n))  # some lashes are short
    length = np.interp(fraction, _POSITIONS_ALONG_ROW, lash_row.length) * variation
    borders = np.sort(rng.uniform(0.0, 1.0, round(1.0 / _CLUMP_SPACING)))
    clump = first_clump + np.searchsorted(borders, fraction).astype(float)  # neighbours that stick together
    pull = rng.uniform(0.35, 0.9, n) * (rng.random(n) < 0.85)
    radius = lash_row.radius * rng.uniform(0.75, 1.15, n)
    return np.stack([splay, first, last, length, radius, clump, pull])


def grow_lashes(
    root_mm: Doubles, eye_mm: Doubles, side_sign: Doubles, shape_parameters: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the knots (n, k, 3) and radii (n, k) of lashes [mm].

    root_mm : (n, 3) roots on the lids [mm]
    eye_mm : (n, 3) centre of the eye to which each lash belongs [mm]
    side_sign : (n,) 1 for lashes of the left eye, -1 for lashes of the right eye
    shape_parameters : (7, n) result of `sample_shapes`; the lashes of a clump must be on the same lid
    """
    splay, first, last, length, radius, clump, pull = shape_parameters
    ahead = root_mm - eye_mm
    ahead = ahead * [0.55, 0.0, 1.0]  # lashes fan out less than the normals of the eye
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0])
    out = np.cross(up, ahead) * side_sign[:, None]
    t = np.linspace(0.0, 1.0, KNOTS_PER_HAIR)
    angle = first + (last - first) * ((t[1:] - 0.5 / (KNOTS_PER_HAIR - 1)) ** 0.8)[:, None]
    directions = np.cos(angle)[..., None] * ahead + np.sin(angle)[..., None] * up
    directions += (splay * (0.4 + 0.6 * t[1:, None]))[..., None] * out
    directions /= np.sqrt((directions**2).sum(axis=-1, keepdims=True))
    steps = (length / (KNOTS_PER_HAIR - 1))[:, None] * directions
    knots = np.cumsum(np.concatenate([[root_mm - 0.25 * ahead], steps]), axis=0).swapaxes(0, 1)
    clumped = _clump_tips(knots, clump.astype(np.int64), pull, t)
    return clumped, radius[:, None] * np.maximum(1.0 - t, 0.0) ** 0.75 * np.minimum(1.0, 0.8 + t)


def _clump_tips(
    knots: Doubles, clump: NDArray[np.int64], attraction: Doubles, knot_position: Doubles
) -> Doubles:
    """Return knots (n, k, 3) of lashes whose tips are pulled towards the mean tip of their clump.

    clump : (n,) index of the clump of each lash
    attraction : (n,) attraction of each lash to its clump, 0 to 1
    knot_position : (k,) position of the knots along the lash, from 0 at the root to 1 at the tip
    """
    count = np.maximum(np.bincount(clump), 1)
    mean = np.stack([np.bincount(clump, knots[:, -1, c]) / count for c in range(3)], axis=-1)
    pull = (mean[clump] - knots[:, -1]) * attraction[:, None]
    return np.asarray(knots + (knot_position**1.6)[None, :, None] * pull[:, None])
