"""The mesh of an eyeball: quads in its true shape."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.eyeball import profile_mm

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

SIDE = 10
"""Quads along each edge of the cube that a ball is made from; an even number, for a point on the axis."""
_RIM = 0.49  # of the layout, around its middle


@cache
def globe(side: int = SIDE, swell: float = 1.0) -> tuple[Doubles, Index]:
    """(n, 3) points of an eyeball around its centre, looking along +Z [mm], and (q, 4) quads.

    swell : by how much control points lie outside of the smooth surface that they make
    """
    places, quads = list[Doubles](), list[Index]()
    grid = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))  # even in angle
    u, v = (part.ravel() for part in np.meshgrid(grid, grid))
    corner = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    face = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(
        -1, 4
    )
    ones = np.ones_like(u)
    for turn in range(3):
        for way in (1.0, -1.0):
            places.append(np.roll(np.stack([way * u, v, way * ones], axis=-1), turn, axis=1))
            quads.append(face + sum(map(len, places[:-1])))
    every = np.concatenate(places)
    _, first, welded = np.unique(np.rint(1e6 * every), axis=0, return_index=True, return_inverse=True)
    along = every[first] / np.linalg.norm(every[first], axis=1, keepdims=True)
    radius = profile_mm(np.arccos(np.clip(along[:, 2], -1.0, 1.0)))
    return swell * radius[:, None] * along, welded.reshape(-1)[np.concatenate(quads)]


@cache
def layout(side: int = SIDE) -> Doubles:
    """(n, 2) uv of an eyeball's points: seen along its axis, by the angle from there; the back is the rim."""
    along = _along(side)
    angle, turn = np.arccos(np.clip(along[:, 2], -1.0, 1.0)), np.arctan2(along[:, 1], along[:, 0])
    radius = _RIM * angle / np.pi
    return 0.5 + np.stack([radius * np.cos(turn), -radius * np.sin(turn)], axis=-1)


def marks(side: int = SIDE) -> tuple[int, int, int]:
    """Points of an eyeball: the cornea's apex, the one opposite, and the one of the equator along +X."""
    along = _along(side)
    apex, back, right = (int(np.argmax(along @ np.array(way))) for way in ((0, 0, 1), (0, 0, -1), (1, 0, 0)))
    return apex, back, right


def _along(side: int) -> Doubles:
    points, _ = globe(side)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))
