"""The one mesh type of the package: triangles with uv, in millimetres."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Ints = NDArray[np.int32]


@dataclass(frozen=True)
class Material:
    """What a group of triangles is made of.

    name : the group's name in the file
    kind : "skin" gets the whole technique, "opaque" plain diffuse and specular (eyeballs, teeth)
    colour : diffuse albedo where no map gives one, linear Rec. 709 [-]
    """

    name: str
    kind: str = "skin"
    colour: tuple[float, float, float] = (0.8, 0.8, 0.8)


@dataclass(frozen=True)
class Mesh:
    """Triangles with attributes at corner vertices; Y up, face towards +Z, counter-clockwise is outside.

    A place on a uv seam has one corner vertex for each of its uvs; `point` tells that they are one place.

    positions : (v, 3) [mm]
    normals : (v, 3) unit vectors
    uv : (v, 2) u to the right, v DOWN: (0, 0) is the top-left corner of every map, in [0, 1]
    dpdu, dpdv : (v, 3) change of position with uv, averaged over the faces around [mm per unit of uv]
    point : (v,) index of the unique position
    triangles : (f, 3) corner vertices
    material : (f,) index into `materials`
    quads : (q, 2) triangles (a, b, c) and (c, d, a) that are the halves of a quad abcd; no rows for none
    """

    positions: Floats
    normals: Floats
    uv: Floats
    dpdu: Floats
    dpdv: Floats
    point: Ints
    triangles: Ints
    material: Ints
    materials: tuple[Material, ...]
    quads: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int32))

    @property
    def size_mm(self) -> NDArray[np.float32]:
        """Extent along x, y and z [mm]."""
        return np.asarray(self.positions.max(axis=0) - self.positions.min(axis=0))

    @cached_property
    def outline(self) -> NDArray[np.float64]:
        """(n, 3) corners of the convex hull [mm]: from wherever it is seen, no place lies farther out."""
        from scipy.spatial import ConvexHull, QhullError

        points = self.positions.astype(np.float64)
        try:
            return np.asarray(points[ConvexHull(points).vertices])
        except QhullError:  # it is flat
            return points

    @cached_property
    def outline_columns(self) -> NDArray[np.float32]:
        """(4, n) the outline as columns, each with a 1 below, for matrices from its left [mm].

        As exact as the positions, and what comes of it in each frame takes half the memory.
        """
        return np.vstack([self.outline.T, np.ones(len(self.outline))]).astype(np.float32)

    @cached_property
    def middle_mm(self) -> tuple[float, float, float]:
        """Halfway between the least and the largest coordinates [mm]."""
        x, y, z = 0.5 * (self.outline.min(axis=0) + self.outline.max(axis=0))
        return float(x), float(y), float(z)
