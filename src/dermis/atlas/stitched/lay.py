"""Laying of shapes into a square of cells, whose rows are one after the other the bits of a number."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

Span = tuple[int, int, int]
"""Row, first and last column of a run of cells."""


def lay_shapes(shapes: Sequence[Sequence[Span]], n: int) -> list[tuple[int, int]] | None:
    """Column and row of shapes in n x n cells, each at the first free place by rows; None if one has none.

    shapes : runs of each, from row and column 0
    """
    taken, corners = 0, []
    for spans in shapes:
        free = _free(taken, spans, n)
        if not free:
            return None
        place = (free & -free).bit_length() - 1
        cells = 0
        for row, first, last in spans:
            cells |= ((2 << last - first) - 1) << row * n + first
        taken |= cells << place
        corners.append((place % n, place // n))
    return corners


def _free(taken: int, spans: Sequence[Span], n: int) -> int:
    """Cells at which the upper left one of a shape may come to lie."""
    height = 1 + max(row for row, _, _ in spans)
    width = 1 + max(last for _, _, last in spans)
    if max(height, width) > n:
        return 0
    blocked, ahead = 0, [taken]  # cells from which one of the next 1, 2, 4, ... is taken
    for row, first, last in spans:
        length = last - first + 1
        step = length.bit_length() - 1
        while len(ahead) <= step:
            ahead.append(ahead[-1] | ahead[-1] >> (1 << len(ahead) - 1))
        blocked |= (ahead[step] | ahead[step] >> length - (1 << step)) >> row * n + first
    rows = _every_row(n) & ((1 << n * (n - height + 1)) - 1)
    return rows * ((2 << n - width) - 1) & ~blocked


@cache
def _every_row(n: int) -> int:
    """The first cell of each row."""
    return ((1 << n * n) - 1) // ((1 << n) - 1)
