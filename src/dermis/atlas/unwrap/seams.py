"""Where charts end: their borders, and the mesh cut open along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.charts import across

Index = NDArray[np.int64]


def border_sides(corner: Index) -> tuple[Index, Index]:
    """Sides (k, 2) that only one triangle has, counter-clockwise around it, and that triangle (k,)."""
    start, end = corner.T.ravel(), np.roll(corner, -1, axis=1).T.ravel()
    alone = np.flatnonzero(across(corner) == np.arange(len(start)))
    return np.column_stack((start, end))[alone], alone % len(corner)


def cut_open(triangles: Index, chart: Index) -> tuple[Index, Index]:
    """Corner vertices (f, 3) of each triangle, and the point (v,) that each of them is.

    Corners stay together where triangles of one chart meet along an edge.

    triangles : (f, 3) points
    chart : (f,)
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    f, other = len(triangles), across(triangles)
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    # sides that run the same way belong to sheets that face opposite ways
    side = np.arange(3 * f)
    joined = (start == end[other]) & (chart[side % f] == chart[other % f]) & (other != side)
    here, there = np.flatnonzero(joined), other[joined]
    after = (side + f) % (3 * f)  # the corner at a side's end is the start of the triangle's next
    one, two = np.concatenate((here, after[here])), np.concatenate((after[there], there))
    links = coo_array((np.ones(len(one)), (one, two)), shape=(3 * f, 3 * f))
    count, vertex = connected_components(links, directed=False)
    point = np.empty(count, dtype=np.int64)
    point[vertex] = start
    return vertex.reshape(3, f).T.astype(np.int64), point
