"""From the field of a bust to its triangles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from dermis.human.bust.fields import Doubles, cone, gradient
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.polygonise import polygonise
from dermis.human.bust.remesh import remesh
from dermis.human.bust.shape import fold, symmetric
from dermis.human.bust.surface import Index, Surface
from dermis.human.bust.warp import make_warp

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


def build_half(parameters: BustParameters, cell: float) -> Surface:
    """The left half of a bust before its warp, open in the plane x = 0; `cell` as for `build_bust`."""

    def field(points: Doubles) -> Doubles:
        return symmetric(points, parameters)

    return remesh(polygonise(field), field, lambda points: cell * edge_length(points), _ROUNDS)


def surface_normals(half: Surface, parameters: BustParameters, cell: float) -> Doubles:
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


def mirror(half: Surface, normals: Doubles) -> tuple[Doubles, Index, Doubles]:
    """Positions, triangles and normals of both halves, joined at the border of the given one."""
    inner, twin = ~half.on_border, twins(half)
    points = np.vstack((half.points, half.points[inner] * (-1, 1, 1)))
    triangles = np.vstack((half.triangles, twin[half.triangles[:, ::-1]]))
    return points, triangles, np.vstack((normals, normals[inner] * (-1, 1, 1)))


def twins(half: Surface) -> Index:
    """Number (n,) of the mirror image of each point of a half, as `mirror` counts; its own on the border."""
    inner = ~half.on_border
    twin = np.arange(len(inner))
    twin[inner] = len(inner) + np.arange(inner.sum())
    return twin
