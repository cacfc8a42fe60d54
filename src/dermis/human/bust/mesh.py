"""From the field of a bust to its triangles, its charts and its uv."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from dermis.atlas.unwrap.charts import grow, tidy
from dermis.atlas.unwrap.seams import shortest_seam
from dermis.atlas.unwrap.unwrap import Layout, unwrap
from dermis.human.bust import ears, neck
from dermis.human.bust.fields import Doubles, cone, gradient, rise
from dermis.human.bust.half_mesh import HalfMesh, Index
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.remesh import polygonise, remesh
from dermis.human.bust.shape import fold, symmetric
from dermis.human.bust.warp import make_warp
from dermis.mesh.mesh import Material, Mesh

# Where the triangles are fine: lines through knots x, y, z, then the radius around them and the edge within.
DETAIL = (
    ([(16, -3.7, 77), (24, -6.7, 82), (31, -7.8, 83.5), (38, -6.8, 80), (45, -2.8, 72)], 1.6, 0.6),
    ([(20, 2, 80), (40, 2, 80)], 8.0, 1.0),
    ([(0, -68, 100), (10, -67.2, 99), (18, -67.4, 95), (26, -68, 87)], 1.8, 0.65),
    ([(0, -69, 100), (10, -68, 98), (22, -68, 90)], 9.0, 1.0),
    ([(0, -85, 93), (18, -85, 88)], 4.0, 2.0),
    ([(3, -46, 105), (8, -47, 98)], 5.0, 0.8),
    ([(14, -38, 96), (16, -43, 92)], 2.5, 1.1),
    ([(0, -36, 114), (6, -38, 110)], 3.0, 1.8),
    ([(80, 10, -26), (78, -10, -22), (73, -32, -10)], 15.0, 1.08),
)
_GROWTH = 0.17  # of the edge, per mm away from there
_COARSEST_MM = 6.5
_ROUNDS = 4
CHARTS = {
    "face": 1.0,
    "back of the head": 0.6,
    "neck": 0.75,
    "bottom": 0.2,
    "left ear front": 1.1,
    "left ear back": 0.7,
    "right ear front": 1.1,
    "right ear back": 0.7,
    "under the chin": 0.7,
}
"""Texels per mm on each chart relative to the face, where it has most [-]."""
# Artist's values on the average head [mm].
_JAW_EDGE = np.array([[-85.0, -108.0], [-8, -87], [30, -78.5], [60, -70], [100, -58]])
"""Depth behind the origin and height of the seam under chin and jaw, up to the nape."""
_CHIN_FLOOR = 13.0
"""From there down to the crease between chin and throat."""
_CROWN_Z, _CROWN_SLOPE = -12.0, 0.1
_MANY = 300


def build_bust(parameters: BustParameters, cell: float = 1.0) -> tuple[Doubles, Index, Doubles]:
    """Positions (n, 3) [mm], triangles (m, 3) and unit normals (n, 3) of a bust, closed and of one piece.

    cell : length of the edges relative to the usual [-]; 1 gives about 50 000 triangles

    The origin is the head's centre, +X to the head's left, +Y up, +Z to its front. The triangles are
    counter-clockwise outside. The same arguments give the same numbers.
    """

    half = build_half(parameters, cell)
    positions, triangles, normals = mirror(half, surface_normals(half, parameters, cell))
    warp = make_warp(parameters)
    return warp.apply(positions), triangles, warp.normals(positions, normals)


def build_half(parameters: BustParameters, cell: float) -> HalfMesh:
    """The left half of a bust before its warp, open in the plane x = 0; `cell` as for `build_bust`."""

    def field(points: Doubles) -> Doubles:
        return symmetric(points, parameters)

    return remesh(polygonise(field), field, lambda points: cell * edge_length(points), _ROUNDS)


def surface_normals(half: HalfMesh, parameters: BustParameters, cell: float) -> Doubles:
    """Normals (n, 3) of half a bust, not of unit length."""
    # steps of the edges' order: finer ones would show creases that the triangles do not have
    step = 0.3 * cell * edge_length(half.points)
    slope = gradient(lambda points: symmetric(points, parameters), half.points, step)
    slope[half.on_border, 0] = 0
    return slope


def edge_length(points: Doubles) -> Doubles:
    """Length that edges should have at each place (n,) [mm]; points (n, 3) [mm]."""
    p = fold(points)
    size = np.full(len(p), _COARSEST_MM)
    for knots, radius, fine in DETAIL:
        for start, end in pairwise(knots):
            away = cone(p, start, end, radius, radius)
            size = np.minimum(size, fine + _GROWTH * np.maximum(away, 0))
    return size


def mirror(half: HalfMesh, normals: Doubles) -> tuple[Doubles, Index, Doubles]:
    """Positions, triangles and normals of both halves, joined at the border of the given one."""
    inner, twin = ~half.on_border, twins(half)
    points = np.vstack((half.points, half.points[inner] * (-1, 1, 1)))
    triangles = np.vstack((half.triangles, twin[half.triangles[:, ::-1]]))
    return points, triangles, np.vstack((normals, normals[inner] * (-1, 1, 1)))


def twins(half: HalfMesh) -> Index:
    """Number (n,) of the mirror image of each point of a half, as `mirror` counts; its own on the border."""
    inner = ~half.on_border
    twin = np.arange(len(inner))
    twin[inner] = len(inner) + np.arange(inner.sum())
    return twin


def bust_mesh(parameters: BustParameters, cell: float = 1.0) -> Mesh:
    """A bust laid out in few charts; `cell` as for `build_bust`."""
    positions, triangles, normals = build_bust(parameters, cell)
    return bust_layout(positions, triangles, parameters).mesh(positions, normals, Material("skin"))


def many_charts_mesh(parameters: BustParameters, cell: float = 1.0) -> Mesh:
    """A bust with as many seams as a layout can have; `cell` as for `build_bust`."""
    positions, triangles, normals = build_bust(parameters, cell)
    return many_charts_layout(positions, triangles).mesh(positions, normals, Material("skin"))


def bust_layout(positions: Doubles, triangles: Index, parameters: BustParameters) -> Layout:
    """Nine charts, with seams over the crown, behind the ears and under the chin."""
    places = make_warp(parameters).undo(positions)
    chart = bust_charts(places, triangles, parameters)
    density, weight = _emphasis(chart, places[triangles].mean(axis=1))
    return unwrap(positions, triangles, chart, _nape(places, triangles, chart), density, weight)


def many_charts_layout(positions: Doubles, triangles: Index) -> Layout:
    """Hundreds of charts, each turned its own way, with seams everywhere."""
    chart = grow(positions, triangles, _MANY)
    upright = np.random.default_rng(0).normal(size=(int(chart.max()) + 1, 3))
    return unwrap(positions, triangles, chart, upright=upright[chart])


def bust_charts(places: Doubles, triangles: Index, parameters: BustParameters) -> Index:
    """Index into `CHARTS` of each triangle (f,).

    places : (n, 3) positions before the warp [mm]
    """
    middle = places[triangles].mean(axis=1)
    half = fold(middle)
    depth, y = -middle[:, 2], middle[:, 1]
    ear, front = ears.sides(half, parameters)
    back = middle[:, 2] < _CROWN_Z + _CROWN_SLOPE * (y - 114)
    chart = np.where(back, 1, 0)
    jaw = np.interp(depth, *_JAW_EDGE.T)
    chart[y < jaw] = 8
    chart[y < jaw - _CHIN_FLOOR * rise(depth, 12, -18)] = 2
    chart[neck.belongs_to_cut(half)] = 3
    chart[ear] = np.where(middle[:, 0] > 0, 4, 6)[ear] + ~front[ear]
    return tidy(chart, triangles)


def _emphasis(chart: Index, middle: Doubles) -> tuple[Doubles, Doubles]:
    """Density and weight (f,) of each triangle, greatest on the face itself; middle (f, 3) [mm]."""
    _, y, z = middle.T
    face, throat = rise(z, -30, 15) * rise(y, 105, 75), rise(y, -230, -120)
    share = np.select([chart == 0, chart == 2], [0.9 + 0.1 * face, 0.5 + 0.5 * throat], 1.0)
    return np.array(list(CHARTS.values()))[chart] * share, np.where(chart == 0, 1 + 5 * face, 1.0)


def _nape(places: Doubles, triangles: Index, chart: Index) -> Index:
    """The seam (s, 2) down the middle of the neck's back."""
    top, cloth, bottom = (np.unique(triangles[chart == k]) for k in (1, 2, 3))
    start, end = (np.intersect1d(cloth, rim) for rim in (top, bottom))
    behind = start[places[start, 2] < 0], end[places[end, 2] < 0]
    return shortest_seam(places, triangles[chart == 2], 1 + np.abs(places[:, 0]), *behind)
