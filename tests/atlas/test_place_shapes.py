"""Placement of shapes on cells: none overlap, and each has the first free position."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.pack import CellRun, place_shapes

N = 24
Flags = NDArray[np.bool_]


def spans_of(mask: Flags) -> list[CellRun]:
    """Return the runs of true cells, found cell by cell."""
    found: list[CellRun] = []
    for y, x in np.argwhere(mask).tolist():
        if x > 0 and mask[y, x - 1]:
            row, first, _ = found.pop()
            found.append((row, first, x))
        else:
            found.append((y, x, x))
    return found


def shapes(count: int) -> list[Flags]:
    """Return random shapes with cells in the first row and column."""
    rng, made = np.random.default_rng(3), list[Flags]()
    for _ in range(count):
        mask = rng.random(rng.integers(1, 9, 2)) < 0.6
        mask[0, rng.integers(mask.shape[1])] = mask[rng.integers(mask.shape[0]), 0] = True
        made.append(mask)
    return made


def test_each_shape_is_at_the_first_free_position() -> None:
    masks = shapes(14)
    corners = place_shapes([spans_of(mask) for mask in masks], N)
    assert corners is not None
    taken = np.zeros((N, N), np.bool_)
    for mask, corner in zip(masks, corners, strict=True):
        used = np.argwhere(mask)
        height, width = used.max(axis=0) + 1
        free = [
            (x, y)
            for y in range(N - height + 1)
            for x in range(N - width + 1)
            if not taken[used[:, 0] + y, used[:, 1] + x].any()
        ]
        assert corner == free[0]
        taken[tuple((used + corner[::-1]).T)] = True


def test_shapes_that_do_not_fit_are_not_placed() -> None:
    square = spans_of(np.ones((N // 2, N // 2), np.bool_))
    assert place_shapes([square] * 4, N) == [(0, 0), (N // 2, 0), (0, N // 2), (N // 2, N // 2)]
    assert place_shapes([*[square] * 4, [(0, 0, 0)]], N) is None
    assert place_shapes([[(0, 0, N)]], N) is None
