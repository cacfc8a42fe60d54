"""Charts of a mesh: growth from random triangles, smooth borders, connected pieces."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import components, edges, sum_by_index, triangle_areas

_SMOOTHING_STEPS = 4
_BEND_PENALTY = 3.0  # extra distance across a right angle, in multiples of the distance


def opposite_sides(triangles: Index) -> Index:
    """Return the neighbouring triangle's side for each side (3 f,), or itself without exactly one neighbour.

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
    """Return the triangles across the sides 01, 12 and 20 of each triangle (f, 3), or itself for none."""
    return (opposite_sides(triangles) % len(triangles)).reshape(3, -1).T


def smooth_charts(chart: Index, triangles: Index) -> Index:
    """Return charts (f,) with smoothed borders, each in one connected piece."""
    return merge_strays(_smooth_borders(chart, triangles), triangles)


def merge_strays(chart: Index, triangles: Index) -> Index:
    """Return charts (f,) with all but the largest connected piece of each merged into adjacent charts."""
    adjacent = neighbours(triangles)
    is_stray = _stray_triangles(chart, adjacent)
    while is_stray.any():
        # strays beside other strays are assigned after those
        adjacent_chart = np.where(
            is_stray[adjacent] | (adjacent == np.arange(len(chart))[:, None]), -1, chart[adjacent]
        )
        found = adjacent_chart.max(axis=1)
        if not (is_stray & (found >= 0)).any():
            break
        chart = np.where(is_stray & (found >= 0), found, chart)
        is_stray = _stray_triangles(chart, adjacent)
    return chart


def _smooth_borders(chart: Index, triangles: Index) -> Index:
    """Return charts (f,) in which each triangle belongs to the prevailing chart of its neighbourhood."""
    corner = triangles.ravel()
    triangle_count = np.maximum(np.bincount(corner), 1)[:, None]
    weight = np.eye(int(chart.max()) + 1)[chart]
    for _ in range(_SMOOTHING_STEPS):
        at_point = sum_by_index(corner, np.repeat(weight, 3, axis=0), len(triangle_count)) / triangle_count
        weight = at_point[triangles].mean(axis=1)
    return np.asarray(weight.argmax(axis=1), dtype=np.int64)


def connected_pieces(chart: Index, adjacent: Index) -> Index:
    """Return the number (f,) of each triangle's connected piece, where a piece is within one chart.

    adjacent : (f, 3) from `neighbours`
    """
    here, there = np.repeat(np.arange(len(chart)), 3), adjacent.ravel()
    same = (chart[here] == chart[there]) & (here < there)
    return components(len(chart), here[same], there[same])


def _stray_triangles(chart: Index, adjacent: Index) -> Mask:
    """Return the mask (f,) of triangles outside the largest piece of their chart."""
    piece = connected_pieces(chart, adjacent)
    size = np.bincount(piece)
    owner = np.zeros(len(size), dtype=np.int64)
    owner[piece] = chart
    order = np.lexsort((np.arange(len(size)), size, owner))
    largest = np.append(owner[order][1:] != owner[order][:-1], True)
    return ~np.isin(piece, order[largest])


def grow_charts(positions: Doubles, triangles: Index, count: int, seed: int = 0) -> Index:
    """Return about `count` charts (f,) grown from random triangles, with borders along bends.

    positions : (n, 3) [mm]
    triangles : (f, 3)
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    corners, adjacent = positions[triangles], neighbours(triangles)
    here, there = np.repeat(np.arange(len(triangles)), 3), adjacent.ravel()
    here, there = here[here != there], there[here != there]
    centre = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    bend = 1 - np.einsum("fi,fi->f", normal[here], normal[there])
    distance = np.linalg.norm(centre[here] - centre[there], axis=1) * (1 + _BEND_PENALTY * bend)
    graph = coo_array((distance, (here, there)), shape=(len(triangles),) * 2).tocsr()
    seeds = _seeds(corners, connected_pieces(np.zeros(len(triangles), dtype=np.int64), adjacent), count, seed)
    source = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)[2]
    return np.unique(source, return_inverse=True)[1].astype(np.int64)


def _seeds(corners: Doubles, piece: Index, count: int, seed: int) -> Index:
    """Return triangles chosen at random by their area, with at least one from each piece."""
    area = triangle_areas(corners)
    drawn = np.random.default_rng(seed).choice(
        len(area), min(count, len(area)), replace=False, p=area / area.sum()
    )
    empty = ~np.isin(piece, piece[drawn])
    first = np.unique(piece[empty], return_index=True)[1]
    return np.concatenate((drawn, np.flatnonzero(empty)[first]))
