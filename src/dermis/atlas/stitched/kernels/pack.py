"""Packing of shapes of cells into a square."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled


@compiled
def pack(
    spans: NDArray[np.int32],
    first: NDArray[np.int64],
    extent: NDArray[np.int32],
    order: NDArray[np.int64],
    n: int,
    corner: NDArray[np.int32],
) -> bool:
    """Lay shapes into n x n cells, each at the first free place by rows; False when one finds none.

    spans : (m, 3) row, first and last column of the runs that the shapes consist of
    first : (p + 1,) where each shape's spans begin
    extent : (p, 2) columns and rows of each
    order : (p,) which comes first
    corner : (p, 2) column and row of each shape's upper left cell, to be written
    """
    taken = np.full((n, n), -1, np.int32)  # the last taken cell of the row, up to and with this one
    for p in order:
        mine = spans[first[p] : first[p + 1]]
        found = False
        for y in range(n - extent[p, 1] + 1):
            x = 0
            while x <= n - extent[p, 0] and not found:
                blocked = -1
                for k in range(len(mine)):
                    last = taken[y + mine[k, 0], x + mine[k, 2]]
                    if last >= x + mine[k, 1]:
                        blocked = last + 1 - mine[k, 1]
                        break
                if blocked < 0:
                    found = True
                else:
                    x = blocked
            if found:
                corner[p, 0], corner[p, 1] = x, y
                break
        if not found:
            return False
        for k in range(len(mine)):
            row = taken[corner[p, 1] + mine[k, 0]]
            begin, end = corner[p, 0] + mine[k, 1], corner[p, 0] + mine[k, 2]
            for x in range(begin, end + 1):
                row[x] = x
            x = end + 1
            while x < n and row[x] < end:
                row[x] = end
                x += 1
    return True
