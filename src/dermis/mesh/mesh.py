"""The one mesh type of the package: triangles with uv, in millimetres."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.arrays import Doubles, Floats, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.geometry import tangents, vertex_normals, weld
from dermis.mesh.outline import Outline, convex_hull

_CROWN_TO_CENTRE_MM = 120.0  # half the height of an adult head

MouthPart = Literal["upper teeth", "lower teeth", "tongue"]
MOUTH_PARTS: tuple[MouthPart, ...] = ("upper teeth", "lower teeth", "tongue")


@dataclass(frozen=True)
class Material:
    """What a group of triangles is made of.

    name : the group's name in the file
    kind : "skin" gets the whole technique, "opaque" plain diffuse and specular (eyeballs, teeth)
    colour : diffuse albedo where no map gives one, linear Rec. 709 [-]
    part : of a mouth whose layout tells where its teeth are, see mouth.wgsl
    eye : whether the file says that eyeballs are made of it
    """

    name: str
    kind: str = "skin"
    colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    part: MouthPart | None = None
    eye: bool = False


@dataclass(frozen=True, repr=False)
class Mesh(ShortRepr):
    """Triangles with attributes at corner vertices; Y up, face towards +Z, counter-clockwise is outside.

    A point on a uv seam has one corner vertex for each of its uvs; `point` is the same for all of them.

    positions : (v, 3) [mm]
    normals : (v, 3) unit vectors
    uv : (v, 2) u to the right, v DOWN: (0, 0) is the top-left corner of every map, in [0, 1]
    point : (v,) index of the unique position
    triangles : (f, 3) corner vertices
    material : (f,) index into `materials`
    quads : (q, 2) triangles (a, b, c) and (c, d, a) that are the halves of a quad abcd; no rows for none
    """

    positions: Floats
    normals: Floats
    uv: Floats
    point: Ints
    triangles: Ints
    material: Ints
    materials: tuple[Material, ...]
    quads: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int32))

    @property
    def points_mm(self) -> Doubles:
        """(p, 3) the unique positions [mm]."""
        points = np.zeros((int(self.point.max()) + 1, 3))
        points[self.point] = self.positions
        return points

    @property
    def size_mm(self) -> Floats:
        """Extent along x, y and z [mm]."""
        return np.asarray(self.positions.max(axis=0) - self.positions.min(axis=0))

    @cached_property
    def outline(self) -> Outline:
        """Corners of the convex hull."""
        return convex_hull(self.positions)

    @cached_property
    def skull_centre_mm(self) -> tuple[float, float, float]:
        """The middle of a head, without neck and shoulders [mm]."""
        x, y, z = self.positions.T
        top = float(y.max())
        skull = y > top - 2 * _CROWN_TO_CENTRE_MM
        middle_x, middle_z = (float(c.min() + c.max()) / 2 for c in (x[skull], z[skull]))
        return middle_x, top - _CROWN_TO_CENTRE_MM, middle_z

    @cached_property
    def topology_key(self) -> bytes:
        """The same for all meshes that differ in where their points are alone."""
        digest = hashlib.blake2b(digest_size=16)
        for part in (self.uv, self.point, self.triangles, self.material):
            digest.update(np.ascontiguousarray(part).tobytes())
        return digest.digest()

    @property
    def dpdu(self) -> Floats:
        """(v, 3) change of position with u, averaged over the faces around [mm per unit of uv]."""
        return self._tangents[0]

    @property
    def dpdv(self) -> Floats:
        """(v, 3) the same with v."""
        return self._tangents[1]

    @cached_property
    def _tangents(self) -> tuple[Floats, Floats]:
        # Only when asked: of a person, whose atlas is its template's, nobody does.
        return tangents(self.positions, self.uv, self.normals, self.triangles)


def _trusted(given: Floats, computed: Floats) -> Floats:
    """The given normals where they are finite and nearly unit, else the computed ones."""
    length = np.linalg.norm(np.where(np.isfinite(given), given, 0).astype(np.float64), axis=1, keepdims=True)
    good = np.isfinite(given).all(axis=1, keepdims=True) & (np.abs(length - 1) < 0.05)
    return np.asarray(np.where(good, given / np.where(good, length, 1), computed).astype(np.float32))


def build_mesh(
    positions: ArrayLike,
    uv: ArrayLike,
    triangles: ArrayLike,
    material: ArrayLike,
    materials: tuple[Material, ...],
    normals: ArrayLike | None = None,
    point: ArrayLike | None = None,
    quads: ArrayLike = (),
) -> Mesh:
    """A `Mesh` with its points welded and its normals computed.

    positions : (v, 3) finite [mm]
    uv : (v, 2) v down
    triangles : (f, 3) corner vertices, at least one
    material : (f,) index into `materials`
    normals : (v, 3) kept where finite and of unit length; computed where not, or when None
    point : (v,) welded points if known; positions that are equal are welded when None
    quads : (q, 2) triangles that are the halves of a quad, as `Mesh` has them
    """
    place = np.ascontiguousarray(positions, dtype=np.float32)
    corner = np.ascontiguousarray(triangles, dtype=np.int32)
    flat = np.ascontiguousarray(uv, dtype=np.float32)
    points = weld(place) if point is None else np.asarray(point, dtype=np.int32)
    normal = vertex_normals(place, points, corner)
    if normals is not None:
        normal = _trusted(np.asarray(normals, dtype=np.float32), normal)
    groups = np.ascontiguousarray(material, dtype=np.int32)
    pairs = np.asarray(quads, dtype=np.int32).reshape(-1, 2)
    return Mesh(place, normal, flat, points, corner, groups, tuple(materials), pairs)
