"""Charts: which triangles are laid flat together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import components, edges, sum_at, triangle_areas

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]

_SMOOTHINGS = 4
_BEND = 3.0  # extra distance across a right angle, in multiples of the distance


def across(triangles: Index) -> Index:
    """The neighbour's side along each side (3 f,), itself where there is none or more than one.

    Sides are numbered as in `geometry.edges`: all 01, then all 12, then all 20.
    """
    _, of_side, counts = edges(triangles)
    side = np.argsort(of_side, kind="stable")
    first = np.cumsum(counts) - counts
    inner = first[counts == 2]
    other = np.arange(3 * len(triangles))
    other[side[inner]], other[side[inner + 1]] = side[inner + 1], side[inner]
    return other


def neighbours(triangles: Index) -> Index:
    """The triangles across the sides 01, 12 and 20 of each (f, 3); itself where there is none."""
    return (across(triangles) % len(triangles)).reshape(3, -1).T


def tidy(chart: Index, triangles: Index) -> Index:
    """Charts (f,) with smooth borders, each in one piece."""
    return join_strays(_smooth(chart, triangles), triangles)


def join_strays(chart: Index, triangles: Index) -> Index:
    """Charts (f,) with all but the largest piece of each given to the charts beside them."""
    beside = neighbours(triangles)
    strays = _strays(chart, beside)
    while strays.any():
        # a stray on the rim of other strays waits until those have joined
        host = np.where(strays[beside] | (beside == np.arange(len(chart))[:, None]), -1, chart[beside])
        found = host.max(axis=1)
        if not (strays & (found >= 0)).any():
            break
        chart = np.where(strays & (found >= 0), found, chart)
        strays = _strays(chart, beside)
    return chart


def _smooth(chart: Index, triangles: Index) -> Index:
    """Each triangle goes to the chart that has the largest share of its surroundings."""
    corner = triangles.ravel()
    around = np.maximum(np.bincount(corner), 1)
    share = np.eye(int(chart.max()) + 1)[chart]
    for _ in range(_SMOOTHINGS):
        at_point = sum_at(corner, np.repeat(share, 3, axis=0), len(around)) / around[:, None]
        share = at_point[triangles].mean(axis=1)
    return np.asarray(share.argmax(axis=1), dtype=np.int64)


def pieces(chart: Index, beside: Index) -> Index:
    """Number (f,) of the connected piece of one chart that each triangle belongs to."""
    here, there = np.repeat(np.arange(len(chart)), 3), beside.ravel()
    same = (chart[here] == chart[there]) & (here < there)
    return components(len(chart), here[same], there[same])


def _strays(chart: Index, beside: Index) -> NDArray[np.bool_]:
    """Triangles (f,) apart from the largest piece of their chart."""
    piece = pieces(chart, beside)
    size = np.bincount(piece)
    owner = np.zeros(len(size), dtype=np.int64)
    owner[piece] = chart
    order = np.lexsort((np.arange(len(size)), size, owner))
    largest = np.append(owner[order][1:] != owner[order][:-1], True)
    return ~np.isin(piece, order[largest])


def grow(positions: Doubles, triangles: Index, count: int, seed: int = 0) -> Index:
    """About `count` charts (f,) grown from random triangles, avoiding bends.

    positions : (n, 3) [mm]
    triangles : (f, 3)
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    corners, beside = positions[triangles], neighbours(triangles)
    here, there = np.repeat(np.arange(len(triangles)), 3), beside.ravel()
    here, there = here[here != there], there[here != there]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    bend = 1 - np.einsum("fi,fi->f", normal[here], normal[there])
    far = np.linalg.norm(middle[here] - middle[there], axis=1) * (1 + _BEND * bend)
    graph = coo_array((far, (here, there)), shape=(len(triangles),) * 2).tocsr()
    seeds = _seeds(corners, pieces(np.zeros(len(triangles), dtype=np.int64), beside), count, seed)
    source = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)[2]
    return np.unique(source, return_inverse=True)[1].astype(np.int64)


def _seeds(corners: Doubles, piece: Index, count: int, seed: int) -> Index:
    """Triangles drawn by their area, and at least one of each piece."""
    area = triangle_areas(corners)
    drawn = np.random.default_rng(seed).choice(
        len(area), min(count, len(area)), replace=False, p=area / area.sum()
    )
    empty = ~np.isin(piece, piece[drawn])
    first = np.unique(piece[empty], return_index=True)[1]
    return np.concatenate((drawn, np.flatnonzero(empty)[first]))
