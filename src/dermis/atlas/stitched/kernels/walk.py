"""Straight walks over a surface, from triangle to triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.surface import Adjacency
from dermis.machine_code import compiled

Doubles = NDArray[np.float64]

_INWARD = 1e-3  # of the way to a place inside the triangle: so that a walk from a corner starts inside
_FIRST, _SECOND = 0.3141, 0.3312  # weights of that place: from the very middle, walks meet corners more often
_MOST_STEPS = 4096


@compiled
def walk(
    adjacency: Adjacency,
    triangle: NDArray[np.int32],
    start: Doubles,
    target: Doubles,
    found: NDArray[np.int32],
    weights: Doubles,
    whole: NDArray[np.bool_],
) -> None:
    """Walk straight from a place in each triangle to a target in its plane, unfolding triangles on the way.

    triangle : (n,)
    start : (n, 2) in the triangle or on its border [mm]
    target : (n, 2) [mm]
    found, weights : (n,), (n, 2) triangle in which the walk ends, and the weights of its second and third
        corner there, to be written
    whole : (n,) whether the target was reached before the surface ended, to be written
    """
    for n in range(len(triangle)):
        f = triangle[n]
        p = adjacency.flat[f]
        third = 1.0 - _FIRST - _SECOND
        inner_x = _FIRST * p[0, 0] + _SECOND * p[1, 0] + third * p[2, 0]
        inner_y = _FIRST * p[0, 1] + _SECOND * p[1, 1] + third * p[2, 1]
        sx = start[n, 0] + _INWARD * (inner_x - start[n, 0])
        sy = start[n, 1] + _INWARD * (inner_y - start[n, 1])
        found[n], weights[n, 0], weights[n, 1], whole[n] = _trace(
            adjacency, f, sx, sy, target[n, 0], target[n, 1]
        )


@compiled
def _cross(ax: float, ay: float, bx: float, by: float) -> float:
    return ax * by - ay * bx


@compiled
def _first_exit(p: Any, sx: float, sy: float, tx: float, ty: float) -> int:
    """Side through which the way from s to t leaves a triangle that s lies in, -1 if t lies in it too."""
    dx, dy = tx - sx, ty - sy
    for k in range(3):
        ax, ay = p[k]
        bx, by = p[(k + 1) % 3]
        passes = _cross(dx, dy, ax - sx, ay - sy) <= 0.0 <= _cross(dx, dy, bx - sx, by - sy)
        if passes and _cross(bx - ax, by - ay, tx - ax, ty - ay) < 0.0:
            return k
    return -1


@compiled
def _trace(
    adjacency: Adjacency, f: int, sx: float, sy: float, tx: float, ty: float
) -> tuple[int, float, float, bool]:
    """Triangle in which the way from s to t ends, the weights there, and whether it is the whole way."""
    p = adjacency.flat[f]
    dx, dy = tx - sx, ty - sy
    k = _first_exit(p, sx, sy, tx, ty)
    if k < 0:
        second, third = _weights(p[0, 0], p[0, 1], p[1, 0], p[1, 1], p[2, 0], p[2, 1], tx, ty)
        return f, second, third, True
    ax, ay = p[k]
    bx, by = p[(k + 1) % 3]
    hand = 1.0
    for _ in range(_MOST_STEPS):
        g = adjacency.beside[f, k]
        if g < 0 or not adjacency.free[g]:
            second, third = _in_order(k, _met(dx, dy, ax - sx, ay - sy, bx - sx, by - sy), 0.0)
            return f, second, third, False
        j = adjacency.entry[f, k]
        if adjacency.flipped[f, k]:
            hand = -hand
        else:
            ax, ay, bx, by = bx, by, ax, ay
        # now a and b are where corners j and j + 1 of g come to lie
        forth, up = adjacency.apex[g, j]
        cx = ax + forth * (bx - ax) - hand * up * (by - ay)
        cy = ay + forth * (by - ay) + hand * up * (bx - ax)
        left = _cross(dx, dy, cx - sx, cy - sy) > 0.0
        a_left = _cross(dx, dy, ax - sx, ay - sy) > 0.0
        # it leaves between the apex and the end on the other side
        if left != a_left:
            ox, oy, k = bx, by, (j + 2) % 3
            px, py, qx, qy = cx, cy, ax, ay
        else:
            ox, oy, k = ax, ay, (j + 1) % 3
            px, py, qx, qy = bx, by, cx, cy
        inner = _cross(qx - px, qy - py, ox - px, oy - py)
        if inner != 0.0 and _cross(qx - px, qy - py, tx - px, ty - py) * inner >= 0.0:
            second, third = _weights(ax, ay, bx, by, cx, cy, tx, ty)
            second, third = _in_order(j, second, third)
            return g, second, third, True
        f = g
        ax, ay, bx, by = px, py, qx, qy
    return f, 1.0 / 3.0, 1.0 / 3.0, False


@compiled
def _met(dx: float, dy: float, ax: float, ay: float, bx: float, by: float) -> float:
    """How far along the side from a to b the way from 0 along d meets it, 0 to 1."""
    here, there = _cross(dx, dy, ax, ay), _cross(dx, dy, bx, by)
    return min(max(here / (here - there), 0.0), 1.0) if here != there else 0.0


@compiled
def _in_order(j: int, b: float, c: float) -> tuple[float, float]:
    """Weights of the second and third corner, given those of the corners j + 1 and j + 2."""
    if j == 0:
        return b, c
    a = 1.0 - b - c
    if j == 1:
        return a, b
    return c, a


@compiled
def _weights(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, tx: float, ty: float
) -> tuple[float, float]:
    """Barycentric weights of b and c at t, none negative."""
    area = _cross(bx - ax, by - ay, cx - ax, cy - ay)
    b = min(max(_cross(tx - ax, ty - ay, cx - ax, cy - ay) / area, 0.0), 1.0)
    c = min(max(_cross(bx - ax, by - ay, tx - ax, ty - ay) / area, 0.0), 1.0)
    total = max(b + c, 1.0)
    return b / total, c / total
