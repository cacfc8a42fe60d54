"""Rules for one level of Loop or Catmull-Clark subdivision.

The rules are sparse matrices with the weights of the old points in each new point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.mesh.geometry import unique_sides

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class Cage(NamedTuple):
    """Polygon mesh before one level of subdivision.

    uv : (v, 2) uv of each vertex
    point : (v,) index of the point at which each vertex lies
    corner : (n,) indices of the vertices at the corners, face by face
    corner_count : (f,) number of corners of each face
    material : (f,) material of each face
    """

    uv: Doubles
    point: Index
    corner: Index
    corner_count: Index
    material: Ints


@dataclass(frozen=True, eq=False)
class _Sides:
    """Edges of a polygon mesh, and the sides (half-edges) of its faces.

    A side runs from one corner of a face to the next. Faces that meet at an edge each have a side on it.

    point_count : number of points
    start : (n,) index of the point where each of the n sides starts
    previous : (n,) index of the preceding side of the same face
    face : (n,) index of the face of each side
    ends : (e, 2) indices of the points at the ends of each of the e edges
    edge : (n,) index of the edge on which each side lies
    border : (e,) mask of border edges, which have one side or more than two sides
    seam_edges : (s, 2) indices of the vertices at the ends of each edge; an edge on a uv seam occurs twice,
        once for each chart
    seam_edge : (n,) row of `seam_edges` for each side
    """

    point_count: int
    start: Index
    previous: Index
    face: Index
    ends: Index
    edge: Index
    border: Mask
    seam_edges: Index
    seam_edge: Index

    @cached_property
    def valence(self) -> Index:
        """Return the number of edges at each point (p,)."""
        return np.bincount(self.ends.ravel(), minlength=self.point_count)

    @cached_property
    def border_valence(self) -> Index:
        """Return the number of border edges at each point (p,)."""
        return np.bincount(self.ends[self.border].ravel(), minlength=self.point_count)


def _find_sides(cage: Cage) -> _Sides:
    last = np.cumsum(cage.corner_count) - 1
    first = last + 1 - cage.corner_count
    index = np.arange(len(cage.corner))
    following, previous = index + 1, index - 1
    following[last], previous[first] = first, last
    seam_edges, seam_edge, _ = unique_sides(np.column_stack((cage.corner, cage.corner[following])))
    start = cage.point[cage.corner]
    ends, edge, counts = unique_sides(np.column_stack((start, start[following])))
    face = np.repeat(np.arange(len(cage.corner_count)), cage.corner_count)
    point_count, border = int(cage.point.max()) + 1, counts != 2
    return _Sides(point_count, start, previous, face, ends, edge, border, seam_edges, seam_edge)


def refine_loop(cage: Cage) -> tuple[csr_array, Cage]:
    """Return the weights (q, p) of old points in the new points, and the subdivided triangles.

    Each triangle becomes four: three at its corners and one in its middle. The new points are the old points
    at new positions, then one point on each edge. Borders become cubic B-splines.

    Source: [Loop1987], with Warren's weights of the old points.
    """
    from scipy.sparse import vstack

    sides = _find_sides(cage)
    # total weight of all neighbours
    neighbours = np.where(sides.valence == 3, 9 / 16, 3 / 8)
    old = _old_point_weights(
        sides, 1 - neighbours, neighbours / np.maximum(sides.valence, 1), border_weight=1 / 8
    )
    opposite = sides.start[sides.previous]
    ends = _edge_end_weights(sides, np.where(sides.border, 1 / 2, 3 / 8))
    new = ends + _sparse_matrix(sides.edge, opposite, _inner_edge_weights(sides, 1 / 8), ends.shape)
    uv, point = _add_edge_vertices(cage, sides)
    a, b, c = cage.corner.reshape(-1, 3).T
    ab, bc, ca = (len(cage.uv) + sides.seam_edge).reshape(-1, 3).T
    four = np.array([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]])
    corner, count = four.transpose(2, 0, 1).ravel(), np.repeat(cage.corner_count, 4)
    return vstack((old, new), "csr"), Cage(uv, point, corner, count, np.repeat(cage.material, 4))


def refine_catmull_clark(cage: Cage) -> tuple[csr_array, Cage]:
    """Return the weights (q, p) of old points in the new points, and the quads of the subdivided mesh.

    A face with k corners becomes k quads. The new points are the old points at new positions, then one point
    on each edge, then one in each face. The first corner of a quad is an old point, the third is the centre
    of the face. Borders become cubic B-splines.

    Sources: [CatmullClark1978]; uv and borders as in [DeRose1998].
    """
    from scipy.sparse import vstack

    sides = _find_sides(cage)
    n, count = np.maximum(sides.valence, 1), len(cage.corner_count)
    centres = _sparse_matrix(
        sides.face, sides.start, 1 / cage.corner_count[sides.face], (count, sides.point_count)
    )
    new = _edge_end_weights(sides, np.where(sides.border, 1 / 2, 1 / 4))
    weights = _inner_edge_weights(sides, 1 / 4)
    new += _sparse_matrix(sides.edge, sides.face, weights, (len(sides.ends), count)) @ centres
    old = _old_point_weights(sides, (n - 2) / n, 1 / n**2, border_weight=1 / 8)
    weights = _inner_point_weights(sides, 1 / n**2)
    old += _sparse_matrix(sides.start, sides.face, weights, (sides.point_count, count)) @ centres
    uv, point = _add_edge_vertices(cage, sides)
    centre = (
        np.add.reduceat(cage.uv[cage.corner], np.cumsum(cage.corner_count) - cage.corner_count)
        / cage.corner_count[:, None]
    )
    edge, face = len(cage.uv) + sides.seam_edge, len(uv) + sides.face
    finer = Cage(
        np.vstack((uv, centre)),
        np.concatenate((point, sides.point_count + len(sides.ends) + np.arange(count))),
        np.column_stack((cage.corner, edge, face, edge[sides.previous])).ravel(),
        np.full(len(cage.corner), 4),
        np.repeat(cage.material, cage.corner_count),
    )
    return vstack((old, new, centres), "csr"), finer


def catmull_clark_limit(cage: Cage) -> csr_array:
    """Return the weights (p, p) that move the points of a mesh of quads to its limit surface.

    Source: [Halstead1993]; borders as cubic B-splines.
    """
    sides = _find_sides(cage)
    n = np.maximum(sides.valence, 1)
    direct = _old_point_weights(sides, n / (n + 5), 4 / (n * (n + 5)), border_weight=1 / 6)
    opposite = sides.start.reshape(-1, 4)[:, [2, 3, 0, 1]].ravel()
    diagonal = _sparse_matrix(
        sides.start, opposite, _inner_point_weights(sides, 1 / (n * (n + 5))), direct.shape
    )
    limit: csr_array = direct + diagonal
    return limit


def _inner_edge_weights(sides: _Sides, edge_weight: float) -> Doubles:
    """Return a weight (n,) for each side: `edge_weight` on inner edges, 0 on borders."""
    return np.where(sides.border, 0, edge_weight)[sides.edge]


def _inner_point_weights(sides: _Sides, point_weight: Doubles) -> Doubles:
    """Return a weight (n,) for each side: the weight of its start point, or 0 if this is a border point.

    point_weight : (p,) weight of each point
    """
    return np.where(sides.border_valence == 0, point_weight, 0)[sides.start]


def _edge_end_weights(sides: _Sides, edge_weight: Doubles) -> csr_array:
    """Return a matrix (e, p): the row of an edge has the edge's weight in the columns of its two end points.

    edge_weight : (e,) weight of each edge
    """
    rows = np.repeat(np.arange(len(sides.ends)), 2)
    return _sparse_matrix(
        rows, sides.ends.ravel(), np.repeat(edge_weight, 2), (len(sides.ends), sides.point_count)
    )


def _old_point_weights(
    sides: _Sides, inner_weight: Doubles, neighbour_weight: Doubles, border_weight: float
) -> csr_array:
    """Return the sparse matrix (p, p) of the weights of old point positions in new point positions.

    Row i is for the new position of point i, and column j for the old position of point j. Callers add
    further weights, such as those of face centres.

    inner_weight : (p,) weight of the old position of each inner point in its own new position
    neighbour_weight : (p,) weight of every neighbour of an inner point in the new position of this point
    border_weight : weight of each of the two border neighbours of a border point in the new position of this
        point
    """
    is_inner, is_border = (sides.border_valence == 0) & (sides.valence > 0), sides.border_valence == 2
    both, other = sides.ends.T.ravel(), sides.ends[:, ::-1].T.ravel()
    edge_weights = np.where(is_inner, neighbour_weight, 0)[both]
    edge_weights[np.tile(sides.border, 2) & is_border[both]] = border_weight
    # points where borders meet, or where the surface is not manifold, do not move
    own_weights = np.where(is_inner, inner_weight, np.where(is_border, 1 - 2 * border_weight, 1))
    index, weights = np.arange(sides.point_count), np.concatenate((own_weights, edge_weights))
    rows, columns = np.concatenate((index, both)), np.concatenate((index, other))
    return _sparse_matrix(rows, columns, weights, (sides.point_count, sides.point_count))


def _add_edge_vertices(cage: Cage, sides: _Sides) -> tuple[Doubles, Index]:
    """Return uv (w, 2) and point index (w,) of the old vertices and of new vertices in the middle of edges.

    The new vertices follow the old vertices. An edge on a uv seam gets a new vertex for each chart.
    """
    edge_of_cut = np.empty(len(sides.seam_edges), dtype=np.int64)
    edge_of_cut[sides.seam_edge] = sides.edge
    uv = np.vstack((cage.uv, cage.uv[sides.seam_edges].mean(axis=1)))
    return uv, np.concatenate((cage.point, sides.point_count + edge_of_cut))


def _sparse_matrix(
    row_index: Index, column_index: Index, weights: Doubles, matrix_shape: tuple[int, int]
) -> csr_array:
    """Return a sparse matrix of nonzero weights; weights with equal row and column are summed."""
    from scipy.sparse import coo_array

    used = weights != 0
    return coo_array((weights[used], (row_index[used], column_index[used])), shape=matrix_shape).tocsr()
