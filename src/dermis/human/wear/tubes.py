"""Tubes and discs of which glasses are made, as grids of points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Ints
from dermis.human.wear.panels import Grid, PanelVertices
from dermis.human.wear.skin_sheet import unit_vectors

TUBE_SIDES = 10
"""Number of points around a tube."""
_SQUARENESS = 0.55  # exponent of the cross-section; 1 is an ellipse, smaller values are rounded rectangles


class Solid(NamedTuple):
    """Rigid surface.

    points : (m, 3) points [mm]
    triangles : (t, 3) indices of points
    slot : name of the material
    vertices : vertices with positions on cloth, whose triangles correspond to `triangles`; None for surfaces
        without threads
    """

    points: Doubles
    triangles: Ints
    slot: str
    vertices: PanelVertices | None = None


def tube(path: Doubles, side: Doubles, half_width: Doubles, half_height: Doubles, slot: str) -> Solid:
    """Return a tube along an open path with closed ends.

    path : (k, 3) middle of the tube [mm]
    side : (k, 3) directions of the width; the height is across them and the path
    half_width, half_height : (k,) half sizes of the cross-section [mm]
    """
    forward = unit_vectors(np.gradient(path, axis=0))
    side = unit_vectors(side - (side * forward).sum(axis=1, keepdims=True) * forward)
    path = np.concatenate([path[:1], path, path[-1:]])
    ends = np.concatenate([[0.02], np.ones(len(half_width)), [0.02]])
    return _grid_around(path, side, forward, half_width, half_height, ends, slot, is_closed=False)


def ring(path: Doubles, side: Doubles, half_width: float, half_height: float, slot: str) -> Solid:
    """Return a closed tube along a closed path (k, 3), with the same parameters as `tube`."""
    forward = unit_vectors(np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0))
    side = unit_vectors(side - (side * forward).sum(axis=1, keepdims=True) * forward)
    ones = np.ones(len(path))
    return _grid_around(
        path, side, forward, half_width * ones, half_height * ones, ones, slot, is_closed=True
    )


def _grid_around(
    path: Doubles,
    side: Doubles,
    forward: Doubles,
    half_width: Doubles,
    half_height: Doubles,
    size: Doubles,
    slot: str,
    *,
    is_closed: bool,
) -> Solid:
    """Return a tube; see `tube` for the parameters.

    forward : (k, 3) unit tangents of the path
    size : factors of the size of the cross-sections, for all points of an open path including its two ends
    is_closed : whether the path is closed
    """
    if not is_closed:
        side, forward, half_width, half_height = (
            np.concatenate([part[:1], part, part[-1:]]) for part in (side, forward, half_width, half_height)
        )
    up = np.cross(forward, side)
    angle = np.arange(TUBE_SIDES) * 2.0 * np.pi / TUBE_SIDES
    x, y = (np.sign(part) * np.abs(part) ** _SQUARENESS for part in (np.cos(angle), np.sin(angle)))
    offset = (size * half_width)[:, None, None] * x[:, None] * side[:, None]
    offset = offset + (size * half_height)[:, None, None] * y[:, None] * up[:, None]
    points = (path[:, None] + offset).reshape(-1, 3)
    if is_closed:  # the path is along the columns, so that the grid closes in both directions
        rows, columns = len(path), TUBE_SIDES
        grid = np.arange(rows * columns).reshape(rows, columns)
        a, b = grid, np.roll(grid, -1, axis=1)
        c, d = np.roll(grid, -1, axis=0), np.roll(np.roll(grid, -1, axis=0), -1, axis=1)
        triangles = np.stack([a, b, d, a, d, c], axis=-1).reshape(-1, 3).astype(np.int32)
    else:
        triangles = Grid(len(path), TUBE_SIDES, True).triangles
    return Solid(points, triangles, slot)


def disc(outline: Doubles, bulge: Doubles, slot: str) -> Solid:
    """Return a curved disc: rings that shrink from its outline (k, 3) to its middle.

    bulge : (3,) offset of the middle [mm]
    """
    rings, middle = [], outline.mean(axis=0)
    sizes = (*np.cos(np.linspace(0.0, 0.5 * np.pi, 12))[:-1].tolist(), 0.02)
    for size in sizes:
        rings.append(middle + size * (outline - middle) + (1.0 - size * size) * bulge)
    front = Grid(len(sizes), len(outline), True).triangles
    return Solid(np.concatenate(rings), front, slot)
