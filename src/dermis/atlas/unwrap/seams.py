"""Seams: paths along edges, and the mesh cut open along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.charts import across
from dermis.errors import refuse
from dermis.mesh.geometry import edges

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]


def shortest_seam(positions: Doubles, triangles: Index, aversion: Doubles, start: Index, end: Index) -> Index:
    """Edges (s, 2) of the cheapest path from any point of `start` to any of `end`.

    positions : (n, 3) [mm]
    triangles : (f, 3) where the path may run
    aversion : (n,) price of a mm there, above 0; high where a seam would be seen
    start, end : point numbers, at least one each

    Raises DermisError when no path joins them.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    ends = edges(triangles)[0]
    length = np.linalg.norm(positions[ends[:, 0]] - positions[ends[:, 1]], axis=1)
    price = length * aversion[ends].mean(axis=1)
    graph = coo_array((price, (ends[:, 0], ends[:, 1])), shape=(len(positions),) * 2).tocsr()
    paid, before, _ = dijkstra(graph, directed=False, indices=start, min_only=True, return_predecessors=True)
    path = [int(end[np.argmin(paid[end])])]
    if not np.isfinite(paid[path[0]]):
        refuse("seam", "two places on one piece of the mesh", "no path joins them", "Choose other ends")
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return np.column_stack((path[:-1], path[1:])).astype(np.int64)


def border_sides(corner: Index) -> tuple[Index, Index]:
    """Sides (k, 2) that only one triangle has, counter-clockwise around it, and that triangle (k,)."""
    start, end = corner.T.ravel(), np.roll(corner, -1, axis=1).T.ravel()
    alone = np.flatnonzero(across(corner) == np.arange(len(start)))
    return np.column_stack((start, end))[alone], alone % len(corner)


def cut_open(triangles: Index, chart: Index, seams: Index) -> tuple[Index, Index]:
    """Corner vertices (f, 3) of each triangle, and the point (v,) that each of them is.

    Corners stay together where triangles of one chart meet along an edge that is no seam.

    triangles : (f, 3) points
    chart : (f,)
    seams : (s, 2) points at the ends of each
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    f, other = len(triangles), across(triangles)
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    # sides that run the same way belong to sheets that face opposite ways
    side = np.arange(3 * f)
    joined = (start == end[other]) & (chart[side % f] == chart[other % f]) & (other != side)
    joined &= ~_is_any(np.column_stack((start, end)), seams)
    here, there = np.flatnonzero(joined), other[joined]
    after = (side + f) % (3 * f)  # the corner at a side's end is the start of the triangle's next
    one, two = np.concatenate((here, after[here])), np.concatenate((after[there], there))
    links = coo_array((np.ones(len(one)), (one, two)), shape=(3 * f, 3 * f))
    count, vertex = connected_components(links, directed=False)
    point = np.empty(count, dtype=np.int64)
    point[vertex] = start
    return vertex.reshape(3, f).T.astype(np.int64), point


def _is_any(pairs: Index, chosen: Index) -> NDArray[np.bool_]:
    """Whether each pair is among the chosen ones, either way round."""
    stride = int(max(pairs.max(initial=0), chosen.max(initial=0))) + 1
    keys, wanted = np.sort(pairs, axis=1), np.sort(chosen.reshape(-1, 2), axis=1)
    return np.isin(keys[:, 0] * stride + keys[:, 1], wanted[:, 0] * stride + wanted[:, 1])
