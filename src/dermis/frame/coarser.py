"""The atlas at half resolution, for light that is already smooth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

SAME_PLACE = 4.0
"""Texels within which the sources of four gutter neighbours are averaged."""


@dataclass(frozen=True)
class Sheet:
    """The data of an n x n atlas that blurs and seams need.

    covered, own : (n, n) texels that show surface, and those of them that do not copy others
    reach : (n, n, 4) texels to the left, right, up and down of the same chart without a gap between
    gutter, source : (a, 2) texels (x, y) beyond a chart's edge, and where their light is [texel]
    """

    covered: NDArray[np.bool_]
    own: NDArray[np.bool_]
    reach: NDArray[np.uint16]
    gutter: NDArray[np.uint16]
    source: NDArray[np.float32]


def halved(sheet: Sheet) -> Sheet:
    """The sheet at half resolution; texels that bilinear reads may touch are computed, not stitched."""
    from scipy.ndimage import binary_dilation

    own = _quads(sheet.own)
    some_own = own[0] | own[1] | own[2] | own[3]
    counted = np.where(some_own, own, _quads(sheet.covered))
    some = counted[0] | counted[1] | counted[2] | counted[3]
    stitched = some & ~binary_dilation(some_own, np.ones((3, 3), bool))
    return Sheet(some, some & ~stitched, _reach(sheet.reach, counted), *_gutter(sheet, stitched))


def _quads(image: NDArray[Any]) -> NDArray[Any]:
    """(4, n/2, n/2) texels (0, 0), (1, 0), (0, 1), (1, 1) of each square of four."""
    return np.stack([image[y::2, x::2] for y in (0, 1) for x in (0, 1)])


def _reach(reach: NDArray[np.uint16], counted: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """Whole squares to the left, right, up and down that all counted texels reach."""
    made = np.zeros((*counted.shape[1:], 4), np.uint16)
    within = np.array([[0, 1, 0, 1], [1, 0, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]])  # to the square's own side
    for side in range(4):
        steps = _quads(reach[..., side]).astype(np.int16) - within[side].astype(np.int16)[:, None, None]
        steps[~counted] = np.iinfo(np.int16).max
        made[..., side] = np.maximum(steps.min(axis=0), 0) // 2
    made[~counted.any(axis=0)] = 0
    return made


def _gutter(sheet: Sheet, stitched: NDArray[np.bool_]) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """The squares that are stitched, and the mean of their texels' sources."""
    x, y = (sheet.gutter.astype(np.int64) // 2).T
    kept = stitched[y, x]
    source = sheet.source[kept].astype(np.float64)
    squares, first, of = np.unique(
        y[kept] * stitched.shape[1] + x[kept], return_index=True, return_inverse=True
    )
    near = np.abs(source - source[first][of]).max(axis=1) < SAME_PLACE
    count = np.bincount(of[near], minlength=len(squares))
    mean = np.stack(
        [np.bincount(of[near], source[near, k], minlength=len(squares)) / count for k in (0, 1)], axis=-1
    )
    gutter = np.stack([squares % stitched.shape[1], squares // stitched.shape[1]], axis=-1)
    return gutter.astype(np.uint16), (0.5 * mean - 0.25).astype(np.float32)
