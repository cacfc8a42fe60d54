"""Division of a mesh into charts: growth from random triangles, smooth borders, connected pieces."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import edges, label_components, sum_by_index, triangle_areas

_SMOOTHING_STEP_COUNT = 4
_BEND_PENALTY = 3.0  # extra length that a step across a right angle counts, relative to the step's length


def opposite_sides(triangles: Index) -> Index:
    """Return, for each triangle side, the index of the neighbour's side at the same edge, (3 f,).

    Sides are numbered as in `geometry.edges`: first the sides 01 of all triangles, then all sides 12, then
    all sides 20. For a side with no neighbour or several neighbours, the result is the side's own index.
    """
    _, of_side, counts = edges(triangles)
    side = np.argsort(of_side, kind="stable")
    first = np.cumsum(counts) - counts
    inner = first[counts == 2]
    other = np.arange(3 * len(triangles))
    other[side[inner]], other[side[inner + 1]] = side[inner + 1], side[inner]
    return other


def neighbour_triangles(triangles: Index) -> Index:
    """Return the index of the triangle across each side 01, 12 and 20, (f, 3).

    For a side with no neighbour or several neighbours, the result is the triangle's own index.
    """
    return (opposite_sides(triangles) % len(triangles)).reshape(3, -1).T


def smooth_charts(triangle_chart: Index, triangles: Index) -> Index:
    """Smooth the borders of charts, and reduce each chart to one connected piece; return charts (f,).

    triangle_chart : (f,) index of the chart of each triangle
    triangles : (f, 3) vertex indices
    """
    return merge_stray_pieces(_smooth_chart_borders(triangle_chart, triangles), triangles)


def merge_stray_pieces(triangle_chart: Index, triangles: Index) -> Index:
    """Merge all but the largest connected piece of each chart into adjacent charts; return charts (f,).

    triangle_chart : (f,) index of the chart of each triangle
    triangles : (f, 3) vertex indices
    """
    adjacent = neighbour_triangles(triangles)
    is_stray = _stray_triangles(triangle_chart, adjacent)
    while is_stray.any():
        # triangles that only have stray neighbours wait until these are assigned
        adjacent_chart = np.where(
            is_stray[adjacent] | (adjacent == np.arange(len(triangle_chart))[:, None]),
            -1,
            triangle_chart[adjacent],
        )
        found = adjacent_chart.max(axis=1)
        if not (is_stray & (found >= 0)).any():
            break
        triangle_chart = np.where(is_stray & (found >= 0), found, triangle_chart)
        is_stray = _stray_triangles(triangle_chart, adjacent)
    return triangle_chart


def _smooth_chart_borders(triangle_chart: Index, triangles: Index) -> Index:
    """Return for each triangle the most frequent chart (f,) in its neighbourhood, which smooths borders.

    The neighbourhood grows in a few steps. In each step, a triangle averages the triangles that share a
    corner with it.

    triangle_chart : (f,) chart of each triangle
    triangles : (f, 3) indices of the triangles' corners
    """
    corner = triangles.ravel()
    triangle_count = np.maximum(np.bincount(corner), 1)[:, None]
    weight = np.eye(int(triangle_chart.max()) + 1)[triangle_chart]
    for _ in range(_SMOOTHING_STEP_COUNT):
        at_point = sum_by_index(corner, np.repeat(weight, 3, axis=0), len(triangle_count)) / triangle_count
        weight = at_point[triangles].mean(axis=1)
    return np.asarray(weight.argmax(axis=1), dtype=np.int64)


def connected_pieces(triangle_chart: Index, adjacent_triangles: Index) -> Index:
    """Return the index (f,) of the connected piece of each triangle; every piece belongs to one chart.

    triangle_chart : (f,) chart of each triangle
    adjacent_triangles : (f, 3) neighbours of each triangle, from `neighbour_triangles`
    """
    here, there = np.repeat(np.arange(len(triangle_chart)), 3), adjacent_triangles.ravel()
    same = (triangle_chart[here] == triangle_chart[there]) & (here < there)
    return label_components(len(triangle_chart), here[same], there[same])


def _stray_triangles(triangle_chart: Index, adjacent_triangles: Index) -> Mask:
    """Return the mask (f,) of triangles outside the largest connected piece of their chart."""
    piece = connected_pieces(triangle_chart, adjacent_triangles)
    size = np.bincount(piece)
    owner = np.zeros(len(size), dtype=np.int64)
    owner[piece] = triangle_chart
    order = np.lexsort((np.arange(len(size)), size, owner))
    largest = np.append(owner[order][1:] != owner[order][:-1], True)
    return ~np.isin(piece, order[largest])


def grow_charts(positions: Doubles, triangles: Index, chart_count: int, seed: int = 0) -> Index:
    """Grow about `chart_count` charts from random triangles; return the chart of each triangle (f,).

    A bend of the surface counts as additional distance, so chart borders tend to follow bends.

    positions : (n, 3) vertices [mm]
    triangles : (f, 3) vertex indices
    chart_count : number of charts; each connected component of the mesh has at least one
    seed : seed of the random choice of triangles
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    corners, adjacent = positions[triangles], neighbour_triangles(triangles)
    here, there = np.repeat(np.arange(len(triangles)), 3), adjacent.ravel()
    here, there = here[here != there], there[here != there]
    centre = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    bend = 1 - np.einsum("fi,fi->f", normal[here], normal[there])
    distance = np.linalg.norm(centre[here] - centre[there], axis=1) * (1 + _BEND_PENALTY * bend)
    graph = coo_array((distance, (here, there)), shape=(len(triangles),) * 2).tocsr()
    seeds = _seed_triangles(
        corners, connected_pieces(np.zeros(len(triangles), dtype=np.int64), adjacent), chart_count, seed
    )
    source = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)[2]
    return np.unique(source, return_inverse=True)[1].astype(np.int64)


def _seed_triangles(corners: Doubles, connected_piece: Index, chart_count: int, seed: int) -> Index:
    """Return random triangles, drawn in proportion to area, with at least one in each connected piece.

    corners : (f, 3, 3) positions of the corners [mm]
    connected_piece : (f,) connected piece to which each triangle belongs
    chart_count : number of triangles to draw at random; one triangle is then added for each connected piece
        without a drawn triangle
    seed : seed of the random choice
    """
    area = triangle_areas(corners)
    drawn = np.random.default_rng(seed).choice(
        len(area), min(chart_count, len(area)), replace=False, p=area / area.sum()
    )
    empty = ~np.isin(connected_piece, connected_piece[drawn])
    first = np.unique(connected_piece[empty], return_index=True)[1]
    return np.concatenate((drawn, np.flatnonzero(empty)[first]))
