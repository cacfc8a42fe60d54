"""Translucency once more in numpy float64: the pairs, and how much light passes between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.translucency.samples import Samples

Floats = NDArray[np.float64]
GRAIN, LEAST_DISC = 0.72, 0.3


def rise(start: float, end: float, x: Floats) -> Floats:
    """From 0 at the start to 1 at the end, smooth at both."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def lie(taken: Samples, given: Samples, radius: float) -> Floats:
    """(m, n, 3) of receivers and sources: depth, distance beside, share that counts."""
    to = given.position[None] - taken.position[:, None]
    square = (to**2).sum(-1)
    depth = np.einsum("mnk,nk->mn", to, given.normal)
    below = -np.einsum("mnk,mk->mn", to, taken.normal)
    share = rise(0.5, -0.2, taken.normal @ given.normal.T)
    share *= rise(-0.5, 0.0, 0.5 * (below + depth) / np.sqrt(np.maximum(square, 1e-12)))
    share[square >= radius**2] = 0.0
    return np.stack([np.abs(depth), np.sqrt(np.maximum(square - depth**2, 0)), share], axis=-1)


def along(atlas: Atlas, taken: Samples, given: Samples, radius: float, same: float) -> Floats:
    """(m, n) distance in the map, infinite where no blur leads; places `same` texels apart are one."""
    corners = atlas.place[np.maximum(atlas.triangle, 0)].astype(float)
    place = np.einsum("yxk,yxkc->yxc", atlas.weights(), corners) * atlas.size - 0.5
    away = np.full((len(taken.texel), len(given.texel)), np.inf)
    rows, columns = np.indices(atlas.triangle.shape)
    for j, texel in enumerate(given.texel):
        y, x = np.nonzero(atlas.coverage & (np.abs(place - texel).max(axis=-1) <= same))
        for ty, tx in zip(rows[y, x], columns[y, x], strict=True):
            du, dv = tx - taken.texel[:, 0], ty - taken.texel[:, 1]
            rx, ry = taken.texel.T
            up = atlas.reach[ry, rx].astype(int)
            across = atlas.reach[ty, rx].astype(int)
            fits = (dv >= -up[:, 2]) & (dv <= up[:, 3]) & (du >= -across[:, 0]) & (du <= across[:, 1])
            su, sv = np.moveaxis(atlas.stretch[ry, rx].astype(float), -1, 0)
            a, b = du / su, dv / sv
            far = np.sqrt(a * a + b * b + 2 * atlas.shear[ry, rx].astype(float) * a * b)
            away[:, j] = np.where(fits, np.minimum(away[:, j], far), away[:, j])
    return np.where(away < radius, away, np.inf)


def passed(
    shape: Floats, far: Floats, area: Floats, radius: float, cell: float, variance: Floats, weight: Floats
) -> Floats:
    """(..., 3) share of a source's light: straight through, less what the blur along the surface brings.

    shape : (..., 3) as `lie` has it; far, area : (...,) along the surface [mm], of the source [mm2]
    variance : of the blurred levels, the first smooth one of which the source shows
    """
    depth, aside, share = np.moveaxis(shape, -1, 0)
    smooth = np.flatnonzero(variance >= (0.45 * cell) ** 2)
    before = variance[smooth[0]] if len(smooth) else variance[-1]
    total = np.zeros((*depth.shape, 3))
    for v, colour in zip(variance, weight, strict=True):
        w = np.maximum(v - before, GRAIN * np.maximum(area, cell**2))
        disc = np.maximum(1 - np.exp(-np.maximum(radius**2 - depth**2, 0) / (2 * w)), LEAST_DISC)
        straight = np.exp(-(depth**2) / (2 * v) - aside**2 / (2 * w)) / disc
        total += (np.maximum(0, straight - np.exp(-(far**2) / (2 * w))) / w)[..., None] * colour
    return np.asarray((share * area / (2 * np.pi))[..., None] * total)


def decoded(words: NDArray[np.uint32]) -> Floats:
    """(n, 3) of shares with one exponent."""
    parts = np.stack([words & 511, (words >> 9) & 511, (words >> 18) & 511], axis=-1)
    return np.asarray(parts * np.exp2((words >> 27).astype(float) - 24)[:, None])
