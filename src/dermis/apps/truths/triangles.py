"""Edges of triangle meshes, and subdivision of triangles at halved edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import edges

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_TRIANGLE_SPLIT_PATTERNS = (
    [[0, 1, 2]],
    [[0, 3, 2], [3, 1, 2]],
    [[3, 1, 4], [0, 3, 4], [0, 4, 2]],
    [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    [[3, 1, 4], [0, 3, 2], [3, 4, 2]],
)
"""Triangles that replace a triangle whose first 0, 1, 2 or 3 sides are halved; vertex 3 + k halves side k.

Two halved sides leave a quadrilateral; the last entry splits it along the other diagonal.
"""


def triangle_edges(positions: Floats, corners: Index) -> tuple[Index, Index, Floats]:
    """Return the edges of a mesh: vertices at their ends, the edge of each triangle side, and lengths.

    The results are the vertex indices (e, 2), the edge indices (f, 3) and the lengths (e,) [mm].

    positions : (n, 3) vertex positions [mm]
    corners : (f, 3) vertex indices; side k runs from corner k to corner k + 1
    """
    ends, edge_of_side, _ = edges(corners)
    length = np.linalg.norm(positions[ends[:, 0]] - positions[ends[:, 1]], axis=1)
    return ends, edge_of_side.reshape(3, -1).T, length


def split_triangles(
    corners: Index, barycentric: Floats, side_midpoints: Index, positions: Floats | None = None
) -> tuple[Index, Index, Floats]:
    """Split triangles at halved sides; return the new triangles, and where they lie in the old triangles.

    The results are the vertex indices (m, 3) of the new triangles; the index (m,) of the triangle that each
    of them is a part of; and the barycentric weights (m, 3, 3) of their corners, defined as in `barycentric`.

    corners : (f, 3) vertex indices of the triangles
    barycentric : (f, 3, 3) for each corner of each triangle, three barycentric weights in the original mesh
        triangle that contains it
    side_midpoints : (f, 3) index of the vertex at the middle of each side; -1 for sides that are not halved
    positions : (n, 3) positions of all vertices; with these, quadrilaterals are split along their shorter
        diagonal [mm]
    """
    halved = side_midpoints >= 0
    count = halved.sum(axis=1)
    # Rotate each triangle so that a single halved side comes first, or a single other one last.
    first = np.select([count == 1, count == 2], [halved.argmax(axis=1), halved.argmin(axis=1) + 1], 0)
    rotation = (np.arange(len(corners))[:, None], (first[:, None] + np.arange(3)) % 3)
    vertices = np.hstack((corners[rotation], side_midpoints[rotation]))
    corner_weights = barycentric[rotation]
    midpoint_weights = (corner_weights + np.roll(corner_weights, -1, axis=1)) / 2
    vertex_weights = np.concatenate((corner_weights, midpoint_weights), axis=1)
    pattern_index = count
    if positions is not None:
        diagonals = positions[vertices[:, [0, 3]]] - positions[vertices[:, [4, 2]]]
        first_longer = np.subtract(*np.square(diagonals).sum(axis=2).T) > 0
        pattern_index = np.where((count == 2) & first_longer, len(_TRIANGLE_SPLIT_PATTERNS) - 1, count)
    parts = []
    for index, pattern in enumerate(_TRIANGLE_SPLIT_PATTERNS):
        parent = np.flatnonzero(pattern_index == index)
        new_triangles = vertices[parent][:, pattern].reshape(-1, 3)
        new_weights = vertex_weights[parent][:, pattern].reshape(-1, 3, 3)
        parts.append((new_triangles, np.repeat(parent, len(pattern)), new_weights))
    return tuple(np.concatenate(one) for one in zip(*parts, strict=True))  # type: ignore[return-value]
