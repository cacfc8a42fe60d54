"""Meshes of worn items without positions, which all people share."""

from __future__ import annotations

from typing import NamedTuple

from dermis.base.arrays import Floats, Index, Ints


class Worn(NamedTuple):
    """Mesh of a worn item without the positions of its points, which depend on the person.

    point : (v,) index of the point of each vertex
    uv : (v, 2) texture coordinates
    triangles : (t, 3) vertices
    material : (t,) index into the materials of the item
    bone, weight : (m, 4) bones that move each of the m points, and their weights
    target, target_point, delta_mm : (n,) index of the expression, (n,) index of the point and (n, 3)
        displacement of the points by expressions [mm]
    """

    point: Ints
    uv: Floats
    triangles: Ints
    material: Ints
    bone: Ints
    weight: Floats
    target: Index
    target_point: Index
    delta_mm: Floats

    @property
    def point_count(self) -> int:
        """Return the number of points."""
        return len(self.bone)
