"""A floor and a wall that rotates about its foot, and the visibility of the sky from the floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from setups import head_of, joined

from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import plane

Floats = NDArray[np.float64]
FOOT_MM = -100.0
HEIGHT_MM = 40.0


def upright(mesh: Mesh, face: float) -> Mesh:
    """Return a plane rotated to be parallel to y, facing +x (1) or -x (-1)."""
    turned = {
        name: np.ascontiguousarray(getattr(mesh, name)[:, [2, 1, 0]] * [face, 1, -face], dtype=np.float32)
        for name in ("positions", "normals")
    }
    return replace(mesh, **turned)


def corner(**maps: Floats) -> Head:
    """Return a floor 200 x 200 at z = 0 with a wall 40 high at x = -100, over its whole length.

    They share no points, so that each has normals of its own.

    maps : as for `head_of`
    """
    wall = upright(plane(200.0, 20), 1.0)
    low = replace(wall, positions=(wall.positions * [1, 1, 0.2]).astype(np.float32))
    parts = (plane(200.0, 20), (0, 0, 0), (0, 0, 0.6)), (low, (-100, 0, 20.01), (0.65, 0.65, 0.3))
    return head_of(joined(*parts), **maps)


def hinged(head: Head, degrees: float) -> NDArray[np.float32]:
    """Return the points of the corner with its wall at an angle to the floor, 90 degrees at rest."""
    points = head.positions_mm.copy()
    wall, angle = points[:, 2] > 0, np.radians(degrees)
    height = points[wall, 2]
    points[wall, 0], points[wall, 2] = FOOT_MM + height * np.cos(angle), height * np.sin(angle)
    return points


def open_beside(d_mm: Floats, degrees: float = 90.0) -> Floats:
    """Return the cosine-weighted visibility of the sky at distances from the foot of a long wall."""
    angle = np.radians(degrees)
    across, above = d_mm - HEIGHT_MM * np.cos(angle), HEIGHT_MM * np.sin(angle)
    return np.asarray(0.5 + 0.5 * across / np.hypot(across, above))
