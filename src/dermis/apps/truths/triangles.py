"""Triangles cut along halved sides: the lengths that say which, and the pieces that are left."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import edges

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_SPLIT_PATTERNS = (
    [[0, 1, 2]],
    [[0, 3, 2], [3, 1, 2]],
    [[3, 1, 4], [0, 3, 4], [0, 4, 2]],
    [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    [[3, 1, 4], [0, 3, 2], [3, 4, 2]],
)
"""What a triangle becomes when 0, 1, 2 or 3 sides are halved, the first ones first; 3 + k halves side k.

With 2, a quadrilateral is left over: the last entry cuts it along the other diagonal.
"""


def triangle_edges(positions: Floats, corners: Index) -> tuple[Index, Index, Floats]:
    """Return ends (e, 2) of the edges, the edge of each triangle's side (f, 3), and lengths (e,) [mm].

    positions : (n, 3) [mm]
    corners : (f, 3) triangles; side k runs from corner k to corner k + 1
    """
    ends, of_side, _ = edges(corners)
    length = np.linalg.norm(positions[ends[:, 0]] - positions[ends[:, 1]], axis=1)
    return ends, of_side.reshape(3, -1).T, length


def split_triangles(
    corners: Index, weights: Floats, middle: Index, positions: Floats | None = None
) -> tuple[Index, Index, Floats]:
    """Return the triangles (m, 3) after halving, which one each was cut from (m,), and its weights (m, 3, 3).

    corners : (f, 3)
    weights : (f, 3, 3) barycentric weights of the corners in a coarse triangle
    middle : (f, 3) vertex in the middle of each side, -1 where the side stays whole
    positions : (n, 3) of all vertices; quadrilaterals are then cut along the shorter diagonal [mm]
    """
    halved = middle >= 0
    count = halved.sum(axis=1)
    # Turn each triangle so that its only halved side comes first, or its only whole one last.
    first = np.select([count == 1, count == 2], [halved.argmax(axis=1), halved.argmin(axis=1) + 1], 0)
    turned = (np.arange(len(corners))[:, None], (first[:, None] + np.arange(3)) % 3)
    vertices = np.hstack((corners[turned], middle[turned]))
    apart = weights[turned]
    apart = np.concatenate((apart, (apart + np.roll(apart, -1, axis=1)) / 2), axis=1)
    case = count
    if positions is not None:
        diagonals = positions[vertices[:, [0, 3]]] - positions[vertices[:, [4, 2]]]
        first_longer = np.subtract(*np.square(diagonals).sum(axis=2).T) > 0
        case = np.where((count == 2) & first_longer, len(_SPLIT_PATTERNS) - 1, count)
    pieces = []
    for number, pattern in enumerate(_SPLIT_PATTERNS):
        chosen = np.flatnonzero(case == number)
        cut = vertices[chosen][:, pattern].reshape(-1, 3), apart[chosen][:, pattern].reshape(-1, 3, 3)
        pieces.append((cut[0], np.repeat(chosen, len(pattern)), cut[1]))
    divided, source, finer = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    return divided, source, finer
